// The camera: frames as fast as the model looks at them, never more than one on its way.

export class Camera {
  #stream = null;
  #video = document.createElement("video");

  get running() {
    return this.#stream !== null;
  }

  /** Asks for the camera, the one on the back where there is a choice, and calls `onFrame` with bitmap after bitmap. */
  async start(onFrame) {
    if (!navigator.mediaDevices?.getUserMedia) {
      throw new Error("browsers give a camera only to pages served by https or from this very machine (localhost)");
    }
    const wanted = { facingMode: "environment", width: { ideal: 1280 }, height: { ideal: 720 } };
    this.#stream = await navigator.mediaDevices.getUserMedia({ video: wanted, audio: false }).catch((error) => {
      throw new Error(cameraRefused(error));
    });
    this.#video.srcObject = this.#stream;
    this.#video.muted = true;
    this.#video.playsInline = true;
    await this.#video.play();
    this.#run(onFrame);
  }

  stop() {
    this.#stream?.getTracks().forEach((track) => track.stop());
    this.#stream = null;
    this.#video.srcObject = null;
  }

  async #run(onFrame) {
    const stream = this.#stream;
    while (this.#stream === stream) {
      await new Promise(requestAnimationFrame);
      if (this.#video.readyState >= HTMLMediaElement.HAVE_CURRENT_DATA && this.#stream === stream) {
        await onFrame(await createImageBitmap(this.#video));
      }
    }
  }
}

function cameraRefused(error) {
  switch (error.name) {
    case "NotAllowedError":
      return "the camera was not allowed: the browser's address bar has the setting";
    case "NotFoundError":
      return "no camera was found on this device";
    case "NotReadableError":
      return "the camera is in use by another program";
    default:
      return `the camera cannot be used: ${error.message}`;
  }
}
