// The camera: the next frame is taken when the model has searched the last one.

export class Camera {
  #video = document.createElement("video");
  #run = null; // An object for each start; a start that finds another one here, or none, was stopped.

  /** Whether the camera was started and not stopped; it may still be opening. */
  get running() {
    return this.#run !== null;
  }

  /**
   * Opens the camera, preferably the one on the back, and calls `onFrame` with each bitmap until `stop`, after which no
   * error is thrown. Throws if the camera cannot be used or is lost, and the errors of `onFrame`.
   */
  async start(onFrame) {
    const run = (this.#run = {});
    try {
      const stream = await openedCamera();
      if (run !== this.#run) {
        stopTracks(stream);
        return;
      }
      this.#video.srcObject = stream;
      this.#video.muted = true;
      this.#video.playsInline = true;
      await this.#video.play();
      await this.#takeFrames(run, stream, onFrame);
    } catch (error) {
      if (run === this.#run) {
        throw error;
      }
    }
  }

  stop() {
    this.#run = null;
    stopTracks(this.#video.srcObject);
    this.#video.srcObject = null;
  }

  async #takeFrames(run, stream, onFrame) {
    const [track] = stream.getVideoTracks();
    for (;;) {
      await new Promise(requestAnimationFrame);
      if (run !== this.#run) {
        return;
      }
      if (track.readyState === "ended") {
        throw new Error("the camera was unplugged, or access to it was withdrawn"); // The video keeps its last frame.
      }
      if (this.#video.readyState >= HTMLMediaElement.HAVE_CURRENT_DATA) {
        const bitmap = await createImageBitmap(this.#video);
        if (run !== this.#run) {
          return;
        }
        await onFrame(bitmap);
      }
    }
  }
}

async function openedCamera() {
  if (!navigator.mediaDevices?.getUserMedia) {
    throw new Error("browsers provide a camera only to pages served by https or from this machine (localhost)");
  }
  const wanted = { facingMode: "environment", width: { ideal: 1280 }, height: { ideal: 720 } };
  return navigator.mediaDevices.getUserMedia({ video: wanted, audio: false }).catch((error) => {
    throw new Error(cameraRefused(error));
  });
}

function stopTracks(stream) {
  stream?.getTracks().forEach((track) => track.stop());
}

function cameraRefused(error) {
  switch (error.name) {
    case "NotAllowedError":
      return "access to the camera was denied: change this in the browser's address bar";
    case "NotFoundError":
      return "no camera was found on this device";
    case "NotReadableError":
      return "the camera is in use by another program";
    default:
      return `the camera cannot be used: ${error.message}`;
  }
}
