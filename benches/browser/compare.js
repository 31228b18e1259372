// Runs the same network on the same picture in one page: our module, and onnxruntime-web with the network's export from
// PyTorch. They run alternately, with one thread each and without WebGPU.

import { Detector } from "./detector.js";
import * as ort from "./ort.wasm.min.mjs";

const HEIGHT = 256;
const WIDTH = 320;

async function bytesOf(file) {
  const response = await fetch(file);
  if (!response.ok) {
    throw new Error(`${file}: status ${response.status}`);
  }
  return response;
}

async function ours() {
  const detector = new Detector();
  await detector.open(await bytesOf("model.sdg"));
  const picture = await (await bytesOf("picture.png")).blob();
  return (verify) => detector.look(picture, verify);
}

async function theirs() {
  ort.env.wasm.numThreads = 1;
  ort.env.wasm.wasmPaths = new URL("./", location.href).href;
  const session = await ort.InferenceSession.create(new Uint8Array(await (await bytesOf("edge.onnx")).arrayBuffer()), {
    executionProviders: ["wasm"],
    graphOptimizationLevel: "all",
  });
  // The picture after our own transform: resized, normalised, padded.
  const pixels = new Float32Array(await (await bytesOf("input.f32")).arrayBuffer());
  const images = new ort.Tensor("float32", pixels, [1, 3, HEIGHT, WIDTH]);
  return async () => {
    const begun = performance.now();
    const { boxes, scores, keypoints } = await session.run({ images });
    const milliseconds = performance.now() - begun;
    return { milliseconds, boxes: [...boxes.data], scores: [...scores.data], keypoints: [...keypoints.data] };
  };
}

/** Times of every run, and the last result of each side, so that the results can be compared. */
window.compare = async (rounds, warmUps) => {
  const [look, run] = [await ours(), await theirs()];
  const times = { network: [], verified: [], theirs: [] };
  const found = {};
  for (let round = -warmUps; round < rounds; round++) {
    found.network = await look(false);
    found.theirs = await run();
    found.verified = await look(true);
    if (round >= 0) {
      for (const side of Object.keys(times)) {
        times[side].push(found[side].milliseconds);
      }
    }
  }
  return { times, network: found.network.record, theirs: found.theirs, version: ort.env.versions.web };
};
window.ready = true;
