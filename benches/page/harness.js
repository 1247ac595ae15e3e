// Runs in every page before its own scripts, ours and the peers' alike: what is measured is measured in one way.
// A page tells `bench.data()` when its voxels or its mesh lie in memory and `bench.painted(view)` whenever it has painted.
(() => {
  const raf = window.requestAnimationFrame.bind(window);
  const drawing = new Set();
  let gpu = null;
  const seen = new Set();
  let [spent, wanted, syncing] = [0, [], false];
  let [dataAt, firstAt, began, steps, slow] = [null, null, 0, [], 0];

  // Drawing by WebGL goes on in another process after the call: reading a pixel waits for it.
  function wait() {
    for (const gl of drawing) {
      const bound = gl.getParameter(gl.READ_FRAMEBUFFER_BINDING);
      gl.bindFramebuffer(gl.READ_FRAMEBUFFER, null);
      gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, new Uint8Array(4));
      gl.bindFramebuffer(gl.READ_FRAMEBUFFER, bound);
    }
    drawing.clear();
  }

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

  // Where the browser has no WebGL, there is nothing to be followed.
  const drawer = window.WebGL2RenderingContext?.prototype ?? {};
  for (const name of ["drawArrays", "drawElements", "drawArraysInstanced", "drawElementsInstanced"]) {
    const before = drawer[name];
    drawer[name] = function (...all) {
      drawing.add(this);
      gpu ??= this.getParameter(this.getExtension("WEBGL_debug_renderer_info")?.UNMASKED_RENDERER_WEBGL ?? this.RENDERER);
      before.apply(this, all);
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

  window.bench = {
    want: (views) => { wanted = views; },
    data() {
      if (dataAt !== null) return;
      dataAt = performance.now();
      seen.clear();
    },
    painted: (view) => seen.add(view),
    first: () => firstAt && { data: dataAt, after: firstAt - dataAt, gpu },
    begin(sync) { [began, steps, slow, syncing] = [performance.now(), [], 0, sync]; },
    end() {
      const seconds = (performance.now() - began) / 1000;
      syncing = false;
      return { frames: steps.length, seconds, steps, slow };
    },
  };
})();
