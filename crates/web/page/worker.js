// The thread of the model: it keeps the page responsive. One request at a time, answered in order.
//
//   {id, open: ArrayBuffer}                    a model file      → {id, summary}
//   {id, look: Blob, verify}                   an image file     → {id, record, milliseconds, decoded}
//   {id, look: ImageBitmap, verify}            a camera's frame  → {id, record, milliseconds, decoded}
//   any error                                                    → {id, error}
//
// `milliseconds` is the duration of the search; `decoded` the duration of decoding. After a panic the module's memory is not
// valid: the answer contains `stopped`, and the page starts another worker.
//
// The address selects the device: `worker.js?device=webgpu` uses the graphics card, with another module.

/** Maximum size of an image file, as on the command line. */
const MAX_IMAGE_BYTES = 256 * 2 ** 20;

const onCard = new URL(import.meta.url).searchParams.get("device") === "webgpu";
const ready = load(onCard ? "./webgpu/sdg_web" : "./sdg_web");
let Model = null;
let model = null;

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
  const othersOfTheWeb = head.startsWith("RIFF") || head.startsWith("GIF8") || head.slice(4, 8) === "ftyp";
  if (othersOfTheWeb) {
    return detectInBitmap(await createImageBitmap(image), verify);
  }
  return () => model.detectInFile(bytes, verify);
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

let before = Promise.resolve();
onmessage = ({ data: request }) => {
  before = before.then(async () => {
    try {
      postMessage({ id: request.id, ...(await answer(request)) });
    } catch (error) {
      const stopped = error instanceof WebAssembly.RuntimeError;
      const message = stopped ? "the model ran out of memory or failed internally, and was restarted" : error.message;
      postMessage({ id: request.id, error: message, stopped });
    }
  });
};
