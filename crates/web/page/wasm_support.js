// Whether this browser can run the module, checked before half a megabyte is loaded.

// The smallest module with a vector: a function without arguments that creates one, reads a lane and drops it.
const VECTOR_MODULE = new Uint8Array([
  0, 0x61, 0x73, 0x6d, 1, 0, 0, 0, // magic, version
  1, 4, 1, 0x60, 0, 0, // type: [] → []
  3, 2, 1, 0, // one function of this type
  10, 11, 1, 9, 0, // code: one body, no locals
  0x41, 0, // i32.const 0
  0xfd, 0x0f, // i8x16.splat
  0xfd, 0x53, // v128.any_true
  0x1a, // drop
  0x0b, // end
]);

/** Whether workers can be modules: only then does the browser read the option. */
function hasModuleWorkers() {
  let isRead = false;
  const options = {
    get type() {
      isRead = true;
      throw new Error("no worker is started");
    },
  };
  try {
    new Worker(import.meta.url, options).terminate();
  } catch {
    // The option was read.
  }
  return isRead;
}

/** The missing feature as a sentence; null if nothing is missing. */
export function missingSupport() {
  if (typeof WebAssembly !== "object") {
    return "This browser has no WebAssembly, which the grasp model needs. Any current Chrome, Edge, Firefox or Safari has it.";
  }
  if (!WebAssembly.validate(VECTOR_MODULE)) {
    return "This browser has WebAssembly, but not its SIMD instructions, which the grasp model needs. Chrome and Edge have them from version 91, Firefox from 89, Safari from 16.4; a locked-down or very old device may lack them.";
  }
  if (typeof OffscreenCanvas !== "function" || typeof Worker !== "function") {
    return "This browser cannot draw outside the page (OffscreenCanvas), which keeps the page fluid during the search. Safari has it from version 16.4.";
  }
  if (!hasModuleWorkers()) {
    return "This browser cannot start a module as a worker, which keeps the page fluid during the search. Chrome and Edge can from version 80, Firefox from 114, Safari from 15.";
  }
  return null;
}
