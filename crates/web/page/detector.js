// The page's interface to the worker: a promise for each request. A request is sent when the one before is answered, so
// that a worker that stops leaves only one unanswered. The next request starts another worker, also if none was started.

export class Detector {
  #worker = null;
  #model = null; // The open model's bytes, for another worker.
  #hasModel = false; // Whether the worker has opened them.
  #closed = false;
  #last = Promise.resolve(); // Ends with the last request.
  #pending = null; // {resolve, reject} of the message that was sent last.

  /** Starts a worker on the processor, or on the graphics card through WebGPU. */
  constructor(device = "processor") {
    this.device = device;
    this.#start(); // The module is loaded before the first request.
  }

  /** Ends the worker; pending requests get an error. */
  close() {
    this.#closed = true;
    this.#stop("the model was closed");
  }

  /**
   * Opens the file of a grasp model and returns its metadata; after an error, the model before stays open. The bytes
   * stay here. Files are read in turn, so that the one given last is the one opened last.
   */
  open(file) {
    return this.#inTurn(async () => {
      const bytes = await file.arrayBuffer();
      const { summary } = await this.#send({ open: bytes });
      this.#model = bytes;
      this.#hasModel = true;
      return summary;
    });
  }

  /** Detects in a file, or in an `ImageBitmap`, whose ownership is transferred: `{record, milliseconds, decoded}`. */
  look(image, verify) {
    return this.#inTurn(async () => {
      if (this.#model && !this.#hasModel) {
        await this.#send({ open: this.#model });
        this.#hasModel = true;
      }
      return this.#send({ look: image, verify }, image instanceof ImageBitmap ? [image] : []);
    });
  }

  #inTurn(work) {
    const done = this.#last.then(work);
    this.#last = done.catch(() => {});
    return done;
  }

  #send(message, transfer = []) {
    if (this.#closed) {
      throw new Error("the model was closed");
    }
    if (!this.#worker) {
      this.#start();
    }
    return new Promise((resolve, reject) => {
      this.#pending = { resolve, reject };
      this.#worker.postMessage(message, transfer);
    });
  }

  #start() {
    this.#worker = new Worker(new URL(`./worker.js?device=${this.device}`, import.meta.url), { type: "module" });
    this.#worker.onmessage = ({ data: { error, stopped, ...result } }) => {
      if (stopped) {
        this.#stop(error);
      } else if (error !== undefined) {
        this.#pending.reject(new Error(error));
      } else {
        this.#pending.resolve(result);
      }
    };
    this.#worker.onerror = (event) => {
      event.preventDefault();
      this.#stop(event.message || "the worker could not be started");
    };
  }

  #stop(reason) {
    this.#worker?.terminate();
    this.#worker = null;
    this.#hasModel = false;
    this.#pending?.reject(new Error(reason));
  }
}
