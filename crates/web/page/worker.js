// The thread of the model: it keeps the page responsive. The page sends a request when the one before is answered.
//
//   {open: ArrayBuffer}                    a model file      → {summary}
//   {look: Blob, verify}                   an image file     → {record, milliseconds, decoded}
//   {look: ImageBitmap, verify}            a camera's frame  → {record, milliseconds, decoded}
//   any error                                                → {error, stopped}
//
// `milliseconds` is the duration of the search; `decoded` the duration of decoding. `stopped` is true if this worker
// cannot answer any more, and the page starts another one: after a panic the module's memory is not valid, and a worker
// does not load a module again that it could not load.
//
// The address selects the device: `worker.js?device=webgpu` uses the graphics card, with another module.

/** Maximum size of an image file, as on the command line. */
const MAX_IMAGE_BYTES = 256 * 2 ** 20;
const STOPPED = { error: "the model ran out of memory or failed internally, and was restarted", stopped: true };

const onCard = new URL(import.meta.url).searchParams.get("device") === "webgpu";
const ready = load(onCard ? "./webgpu/sdg_web" : "./sdg_web");
ready.catch(() => {}); // The first request gets the error.
let Model = null;
let model = null;
let isAnswering = false;

async function load(name) {
  const module = await import(`${name}.js`);
  // Compiled while it is loaded if the host sends the correct type; some static hosts do not.
  const response = await fetch(new URL(`${name}_bg.wasm`, import.meta.url));
  if (!response.ok) {
    throw new Error(`the module ${name}_bg.wasm is missing on this host (status ${response.status})`);
  }
  const streams = (response.headers.get("content-type") ?? "").startsWith("application/wasm");
  await module.default({ module_or_path: streams ? response : await response.arrayBuffer() });
  Model = module.Model;
}

async function answer(request) {
  await ready;
  if (request.open) {
    const opened = await Model.open(new Uint8Array(request.open));
    model?.free();
    model = opened;
    return { summary: JSON.parse(model.summary()) };
  }
  if (!model) {
    throw new Error("no grasp model is open");
  }
  const begun = performance.now();
  const look = await prepared(request.look, request.verify);
  const decoded = performance.now() - begun;
  const record = JSON.parse(await look());
  return { record, decoded, milliseconds: performance.now() - begun - decoded };
}

/** The search, not yet started: files that our decoder supports are passed unchanged, so that a page sees the same pixels as `sdg`. */
async function prepared(image, verify) {
  if (image instanceof ImageBitmap) {
    return detectInBitmap(image, verify);
  }
  if (image.size > MAX_IMAGE_BYTES) {
    throw new Error(`expected an image of at most ${MAX_IMAGE_BYTES} bytes, found ${image.size}`);
  }
  const bytes = new Uint8Array(await image.arrayBuffer());
  const head = String.fromCharCode(...bytes.subarray(0, 12));
  const othersOfTheWeb = /^(RIFF|GIF8|BM|....ftyp)/s.test(head);
  // Our decoder's error also tells how to get a picture from a file that the browser cannot decode, such as HEIC.
  const bitmap = othersOfTheWeb && (await createImageBitmap(image).catch(() => null));
  return bitmap ? detectInBitmap(bitmap, verify) : () => model.detectInFile(bytes, verify);
}

function detectInBitmap(bitmap, verify) {
  const { width, height } = bitmap;
  const context = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true });
  context.fillStyle = "white"; // Transparent pixels are composited over white, as on the command line.
  context.fillRect(0, 0, width, height);
  context.drawImage(bitmap, 0, 0);
  bitmap.close();
  const pixels = context.getImageData(0, 0, width, height).data;
  return () => model.detectInPixels(pixels, width, height, verify);
}

async function answerOrError(request) {
  try {
    return await answer(request);
  } catch (error) {
    return error instanceof WebAssembly.RuntimeError ? STOPPED : { error: error.message, stopped: !Model };
  }
}

onmessage = async ({ data: request }) => {
  isAnswering = true;
  const answered = await answerOrError(request);
  isAnswering = false;
  postMessage(answered);
};

// The module computes in microtasks: a panic in one is an error of the worker, and leaves the request's promise pending.
addEventListener("error", (event) => {
  if (isAnswering) {
    event.preventDefault();
    postMessage(STOPPED);
  }
});
