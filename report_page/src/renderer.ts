// What draws: with smooth edges where there is a graphics card.
import * as THREE from "three";

/** Throws an error that says what the browser lacks. */
export function madeRenderer(): THREE.WebGLRenderer {
  const settings = {
    alpha: true,
    depth: true,
    preserveDrawingBuffer: true,
    powerPreference: "high-performance" as const,
  };
  const canvas = document.createElement("canvas");
  const context = canvas.getContext("webgl2", { ...settings, antialias: false });
  // Without a graphics card smooth edges would cost more than all else, and so would to start twice.
  if (!context) throw new Error("it has no WebGL 2, or has switched it off");
  if (isProcessor(context)) return prepared({ ...settings, canvas, context });
  context.getExtension("WEBGL_lose_context")?.loseContext();
  return prepared({ ...settings, antialias: true });
}

function isProcessor(context: WebGL2RenderingContext): boolean {
  const told = context.getExtension("WEBGL_debug_renderer_info");
  const name = String(context.getParameter(told?.UNMASKED_RENDERER_WEBGL ?? context.RENDERER));
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

function prepared(settings: THREE.WebGLRendererParameters): THREE.WebGLRenderer {
  const renderer = new THREE.WebGLRenderer(settings);
  renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
  renderer.autoClear = false;
  renderer.setClearColor(0, 0); // also for the first picture
  return renderer;
}
