// The thread that the model looks in, so that the page stays fluid. One request at a time, answered in order.
//
//   {id, open: ArrayBuffer}                    a model file      → {id, summary}
//   {id, look: Blob, verify}                   an image file     → {id, record, milliseconds, decoded}
//   {id, look: ImageBitmap, verify}            a camera's frame  → {id, record, milliseconds, decoded}
//   whatever goes wrong                                          → {id, error}
//
// `milliseconds` is the time of the look itself; `decoded` that of getting at the pixels. After a panic the module's
// memory cannot be trusted: the answer says `stopped`, and the page starts another worker.
//
// The address says where to compute: `worker.js?device=webgpu` on the graphics card, which is another module.

/** The limit of the command line: larger files than any camera makes. */
const MAX_IMAGE_BYTES = 256 * 2 ** 20;

const onCard = new URL(import.meta.url).searchParams.get("device") === "webgpu";
const ready = load(onCard ? "./webgpu/sdg_web" : "./sdg_web");
let Model = null;
let model = null;

async function load(name) {
  const module = await import(`${name}.js`);
  // Compiled while it arrives where the host names the type; some static hosts do not.
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

/** The look, ready to be taken: files that our own decoder reads go in whole, so that a page sees what `sdg` sees. */
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
  context.fillStyle = "white"; // As the command line lays what is transparent over white.
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
      const message = stopped ? "the model ran out of memory or met a fault of its own, and was started again" : error.message;
      postMessage({ id: request.id, error: message, stopped });
    }
  });
};
