// The camera: the next frame is taken when the model has searched the last one.

export class Camera {
  #stream = null;
  #video = document.createElement("video");

  get running() {
    return this.#stream !== null;
  }

  /** Opens the camera, preferably the one on the back, and calls `onFrame` with each bitmap. */
  async start(onFrame) {
    if (!navigator.mediaDevices?.getUserMedia) {
      throw new Error("browsers provide a camera only to pages served by https or from this machine (localhost)");
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
      return "access to the camera was denied: change this in the browser's address bar";
    case "NotFoundError":
      return "no camera was found on this device";
    case "NotReadableError":
      return "the camera is in use by another program";
    default:
      return `the camera cannot be used: ${error.message}`;
  }
}
