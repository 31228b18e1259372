// The page's interface to the worker: a promise for each request, and a new worker if one stopped. If a worker cannot be
// started, each request gets the reason.

export class Detector {
  #device;
  #worker = null;
  #model = null; // The open model's bytes, for a worker that has to be started again.
  #notStarted = null; // Why the worker could not be started.
  #waiting = new Map();
  #nextId = 1;

  /** Starts a worker on the processor, or on the graphics card through WebGPU. */
  constructor(device = "processor") {
    this.#device = device;
    this.#start();
  }

  /** Ends the worker; pending requests get an error. */
  close() {
    this.#fail("the model was closed");
  }

  /** Opens a grasp model and returns its metadata. The bytes stay in the page. */
  async open(bytes) {
    const { summary } = await this.#ask({ open: bytes });
    this.#model = bytes;
    return summary;
  }

  /** Detects in a file, or in an `ImageBitmap`, whose ownership is transferred: `{record, milliseconds, decoded}`. */
  look(image, verify) {
    return this.#ask({ look: image, verify }, image instanceof ImageBitmap ? [image] : []);
  }

  #start() {
    this.#worker = new Worker(new URL(`./worker.js?device=${this.#device}`, import.meta.url), { type: "module" });
    this.#worker.onmessage = ({ data }) => this.#receive(data);
    this.#worker.onerror = (event) => {
      event.preventDefault();
      this.#notStarted = event.message || "the worker could not be started";
      this.#fail(this.#notStarted);
    };
  }

  #ask(request, transfer = []) {
    if (this.#notStarted) {
      return Promise.reject(new Error(this.#notStarted));
    }
    const id = this.#nextId++;
    return new Promise((resolve, reject) => {
      this.#waiting.set(id, { resolve, reject });
      this.#worker.postMessage({ id, ...request }, transfer);
    });
  }

  #receive({ id, error, stopped, ...result }) {
    const waiting = this.#waiting.get(id);
    this.#waiting.delete(id);
    if (error) {
      waiting?.reject(new Error(error));
    } else {
      waiting?.resolve(result);
    }
    if (stopped) {
      this.#startAgain("the model had to be restarted");
    }
  }

  #fail(reason) {
    this.#worker.terminate();
    const lost = [...this.#waiting.values()];
    this.#waiting.clear();
    lost.forEach(({ reject }) => reject(new Error(reason)));
  }

  #startAgain(reason) {
    this.#fail(reason);
    this.#start();
    if (this.#model) {
      // A model with which the worker stops again is not opened forever.
      this.#ask({ open: this.#model }).catch(() => (this.#model = null));
    }
  }
}
