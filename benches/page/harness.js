// Runs in every page before its own scripts, ours and the peers' alike: what is measured is measured in one way.
// A page tells `bench.data()` when its voxels or its mesh lie in memory and `bench.painted(view)` whenever it has painted.
(() => {
  const raf = window.requestAnimationFrame.bind(window);
  const contexts = [];
  const seen = new Set();
  let [spent, wanted, syncing] = [0, [], false];
  let [dataAt, firstAt, began, steps, slow] = [null, null, 0, [], 0];

  // Drawing by WebGL goes on in another process after the call: reading a pixel waits for it.
  const wait = () => contexts.forEach((gl) => gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4)));

  function timed(work) {
    const start = performance.now();
    const before = seen.size;
    work();
    if (seen.size > before && (syncing || firstAt === null)) wait();
    spent += performance.now() - start;
  }

  window.requestAnimationFrame = (work) => raf((time) => timed(() => work(time)));
  const listen = EventTarget.prototype.addEventListener;
  EventTarget.prototype.addEventListener = function (name, work, options) {
    const wrapped = name === "wheel" && typeof work === "function" ? function (event) { timed(() => work.call(this, event)); } : work;
    listen.call(this, name, wrapped, options);
  };

  for (const kind of [HTMLCanvasElement, OffscreenCanvas]) {
    const before = kind.prototype.getContext;
    kind.prototype.getContext = function (name, ...rest) {
      const context = before.call(this, name, ...rest);
      if (context && name.startsWith("webgl") && !contexts.includes(context)) contexts.push(context);
      return context;
    };
  }

  // Between two frames: what the last one has painted is counted.
  function tick() {
    raf(tick);
    const whole = wanted.length > 0 && wanted.every((view) => seen.has(view));
    if (whole && firstAt === null && dataAt !== null) firstAt = performance.now();
    if (whole) steps.push(spent);
    seen.clear();
    spent = 0;
  }
  raf(tick);
  new PerformanceObserver((list) => { slow += list.getEntries().length; }).observe({ type: "longtask" });

  const gpu = () => {
    const gl = contexts[0];
    return gl ? gl.getParameter(gl.getExtension("WEBGL_debug_renderer_info")?.UNMASKED_RENDERER_WEBGL ?? gl.RENDERER) : null;
  };
  window.bench = {
    want: (views) => { wanted = views; },
    data() {
      if (dataAt !== null) return;
      dataAt = performance.now();
      seen.clear();
    },
    painted: (view) => seen.add(view),
    first: () => firstAt && { data: dataAt, after: firstAt - dataAt, gpu: gpu() },
    begin(sync) { [began, steps, slow, syncing] = [performance.now(), [], 0, sync]; },
    end() {
      const seconds = (performance.now() - began) / 1000;
      syncing = false;
      return { frames: steps.length, seconds, steps, slow };
    },
  };
})();
