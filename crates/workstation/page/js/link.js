// The only module that talks to the server.
import { change, now } from "./state.js";

const pause = (/** @type {number} */ ms) => new Promise((done) => setTimeout(done, ms));
const kept = "supine-token";
/** The status of an answer to a key that holds no longer. */
const outdated = 204;

/** Takes the key out of the address, where history and shoulders would read it. A reload comes without one. */
export function takeToken() {
  const token = location.hash.slice(1);
  if (token) sessionStorage.setItem(kept, token);
  if (location.hash) history.replaceState(null, "", location.pathname);
}

const token = () => sessionStorage.getItem(kept) ?? "";

/**
 * @param {string} path
 * @param {{body?: any, signal?: AbortSignal}} [options]
 */
function ask(path, { body, signal } = {}) {
  /** @type {Record<string, string>} */
  const headers = { Authorization: `Bearer ${token()}` };
  if (body !== undefined) headers["Content-Type"] = "application/json";
  const method = body === undefined ? "GET" : "POST";
  return fetch(path, { method, headers, signal, cache: "no-store", body: body && JSON.stringify(body) });
}

/** What a refused request says, as a problem. @param {Response} answer */
async function refusal(answer) {
  if (answer.status === 401) change({ link: "refused" });
  const told = await answer.json().catch(() => null);
  return { message: told?.error?.message ?? `The program refused this (${answer.status}).`, advice: told?.error?.advice ?? null };
}

/** After so long without an answer the user is told, ms. */
const patience = 3000;

/** Waits for an answer; that none comes is told after a while. @param {Promise<Response>} asked */
async function timely(asked) {
  let late = 0;
  const tell = () => {
    late = 1;
    change({ late: now().late + 1 });
  };
  const timer = setTimeout(tell, patience);
  try {
    return await asked;
  } finally {
    clearTimeout(timer);
    if (late) change({ late: now().late - 1 });
  }
}
/** Commands that change the case whatever it holds. */
const changing = new Set(["tick", "save"]);

/** Counts a change of the case until it is answered. @template T @param {() => Promise<T>} work @returns {Promise<T>} */
async function counted(work) {
  change({ unanswered: now().unanswered + 1 });
  try {
    return await work();
  } finally {
    change({ unanswered: now().unanswered - 1 });
  }
}

/** Sends a command; what goes wrong is shown. @param {string} name @param {object} [body] @returns {Promise<boolean>} */
export const send = (name, body = {}) => (changing.has(name) ? counted(() => sendNow(name, body)) : sendNow(name, body));

/** @param {string} name @param {object} body @returns {Promise<boolean>} */
async function sendNow(name, body) {
  try {
    const answer = await timely(ask(`/api/${name}`, { body }));
    // What was refused before is no problem any more when the next command is taken.
    change({ problem: answer.ok ? null : await refusal(answer) });
    return answer.ok;
  } catch {
    change({ problem: mute });
    return false;
  }
}

const mute = { message: "The program does not answer.", advice: "See whether it still runs." };
const revision = () => now().server?.revision ?? 0;

/** @type {Promise<unknown>} */
let last = Promise.resolve();
/** Changes of the case are made one after the other, each from what the one before left: what is typed faster than it is answered is
 * no conflict. @template T @param {() => Promise<T>} work @returns {Promise<T>} */
function inTurn(work) {
  const turn = last.then(work);
  last = turn.catch(() => {});
  return turn;
}

/** A way in the history of the case as this page shows it: refused when another window was faster.
 * @param {string} name @param {object} [body] @returns {Promise<boolean>} */
const changeCase = (name, body = {}) => counted(() => inTurn(async () => {
  const taken = await sendNow(name, { revision: revision(), ...body });
  await poll();
  return taken;
}));

/** @typedef {{key: string, value: any}[]} Edits */

const values = () => now().server?.case?.values ?? {};
/** Which case is open: another window may open another one. */
const opened = () => now().server?.volumes.find(({ id }) => id === "ct")?.key;
/** @param {any} a @param {any} b */
const same = (a, b) => JSON.stringify(a ?? null) === JSON.stringify(b ?? null);

/** What this page has put into the case: it is no conflict with what it puts there next. @type {Map<string, any>} */
const own = new Map();

/** What the case said when the user began to type in a field. @type {{field: EventTarget|null, values: Record<string, any>}|null} */
let typing = null;
addEventListener("input", ({ target }) => {
  if (typing?.field !== target) typing = { field: target, values: values() };
}, true);
for (const end of ["change", "focusout"]) {
  addEventListener(end, () => {
    const ended = typing;
    // What the field sets is sent first.
    setTimeout(() => { if (typing === ended) typing = null; });
  }, true);
}
/** What the user saw of the case when the change began that is made now. */
export const valuesSeen = () => typing?.values ?? values();

/** @type {((mine: boolean) => void)|null} */
let decide = null;
/** Whether the user wants what this window has, and not what another one put there. @param {import("./state.js").Conflict[]} conflict
 * @returns {Promise<boolean>} */
const mineIsWanted = (conflict) => new Promise((done) => {
  decide = done;
  change({ conflict });
});
/** The user's choice. @param {boolean} mine */
export function choose(mine) {
  change({ conflict: null });
  decide?.(mine);
  decide = null;
}

/** Makes a change of the case from its newest values. Where another window has changed the same values since the user saw them, the user
 * is asked which are to stay. @param {string} name of the command @param {object} body beside the edits of an edit @param {Edits} edits what it sets
 * @param {Record<string, any>} [seen] what the user saw @returns {Promise<boolean>} */
function changeSeen(name, body, edits, seen = valuesSeen()) {
  const ofThis = opened();
  return counted(() => inTurn(async () => {
    try {
      for (;;) {
        if (opened() !== ofThis) {
          change({ problem: { message: "Another case was opened in another window: this change was not made.", advice: null } });
          return false;
        }
        const newest = values();
        const theirs = edits.filter(({ key, value }) => !same(newest[key], seen[key]) && !same(newest[key], value)
          && !(own.has(key) && same(newest[key], own.get(key))));
        // What the user left as it was stays as the other window has it.
        const differ = theirs.filter(({ key, value }) => !same(value, seen[key]));
        if (differ.length > 0) {
          if (!await mineIsWanted(differ.map(({ key, value }) => ({ key, mine: value ?? null, theirs: newest[key] ?? null })))) return false;
          seen = newest;
          continue;
        }
        const kept = edits.filter((one) => !theirs.includes(one));
        const what = name === "edit" ? { edits: kept } : body;
        const answer = await timely(ask(`/api/${name}`, { body: { revision: revision(), ...what } }));
        if (answer.ok) kept.forEach(({ key, value }) => own.set(key, value ?? null));
        else if (answer.status !== 409) change({ problem: await refusal(answer) });
        if (answer.status !== 409) {
          if (answer.ok) change({ problem: null });
          await poll();
          return answer.ok;
        }
        if (await poll() !== "live") break;
      }
    } catch {
      // It is told below.
    }
    change({ problem: mute });
    return false;
  }));
}

/** @param {Edits} edits @param {Record<string, any>} [seen] what the user saw when the change began */
export const edit = (edits, seen) => changeSeen("edit", {}, edits, seen);

/** Sends edits that are made from the case's newest values: when someone else was faster they are made anew, once.
 * @param {(values: Record<string, any>) => {key: string, value: any}[]} edits @returns {Promise<boolean>} */
export const editNewest = (edits) => counted(() => inTurn(() => editNow(edits)));

/** @param {(values: Record<string, any>) => {key: string, value: any}[]} edits @returns {Promise<boolean>} */
async function editNow(edits) {
  const ofThis = opened();
  try {
    for (const last of [false, true]) {
      const answer = await timely(ask("/api/edit", { body: { revision: revision(), edits: edits(values()) } }));
      if (answer.ok) {
        change({ problem: null });
        await poll();
        return true;
      }
      const refused = answer.status !== 409 || last;
      if (!refused) await poll();
      if (refused || opened() !== ofThis) {
        change({ problem: await refusal(answer) });
        return false;
      }
    }
  } catch {
    change({ problem: mute });
  }
  return false;
}

/** The case carries an object along, or not. @param {string} id @param {boolean} on */
export const carry = (id, on) => changeSeen("carry", { id, on }, []);
/** A region of a structure set becomes the tumour. @param {string} id @param {string} region */
export const tumourFrom = (id, region) => changeSeen("tumour", { id, region }, [{ key: "tumour.structure", value: region },
  { key: "tumour.centre", value: null }, { key: "tumour.radius", value: null }]);
export const undo = () => changeCase("undo");
export const redo = () => changeCase("redo");
/** @param {string|null} until */
export const run = (until) => send("run", { until });
/** The whole run, written into a folder. @param {string} dir @param {string} name */
export const runInto = (dir, name) => send("run", { until: null, out: { dir, name } });
/** To a DICOM node. @param {string} to @param {string|null} confirm words that were typed */
export const sendTo = (to, confirm) => send("send", { to, confirm });
/** A running navigation. @param {string} address */
export const followAt = (address) => send("follow", { address });
export const leave = () => send("leave");
/** @param {string} id @param {boolean} on */
export const tick = (id, on) => send("tick", { id, on });
/** Throws away what was kept of a case. @param {string} id */
export const discard = (id) => send("discard", { id });
/** Whose CT a case, a run or what was kept is of, in one line. @param {string} id @returns {Promise<string|null>} */
export async function whose(id) {
  const answer = await ask(`/api/whose/${encodeURIComponent(id)}`).catch(() => null);
  return answer?.ok ? (await answer.json()).whose : null;
}
/** @param {string} dir @param {string} name */
export const saveAs = (dir, name) => send("save", { dir, name });
export const cancel = () => send("cancel");

/** Lists a folder into the state. @param {string|null} dir */
export async function list(dir) {
  try {
    const answer = await ask(dir === null ? "/api/list" : `/api/list?dir=${encodeURIComponent(dir)}`);
    change(answer.ok ? { list: await answer.json() } : { problem: await refusal(answer) });
  } catch {
    change({ problem: { message: "The folder cannot be listed: the program does not answer.", advice: null } });
  }
}

/** The picture of a series as an address that an image can show. @param {string} series @returns {Promise<string|null>} */
export async function picture(series) {
  const answer = await ask(`/api/picture/${encodeURIComponent(series)}`).catch(() => null);
  return answer?.ok ? URL.createObjectURL(await answer.blob()) : null;
}

/**
 * Reads a volume piece by piece. An outdated key gives false, and the newest state is fetched.
 * @param {string} id @param {string} key @param {Uint8Array} into
 * @param {(arrived: number) => void} told @param {AbortSignal} signal
 */
export async function readVolume(id, key, into, told, signal) {
  const answer = await ask(`/api/volume/${encodeURIComponent(id)}/${encodeURIComponent(key)}`, { signal });
  if (answer.status === outdated) await poll();
  if (!answer.ok || !answer.body) return false;
  const reader = answer.body.getReader();
  let arrived = 0;
  for (;;) {
    const { done, value } = await reader.read();
    if (done) break;
    if (arrived + value.length > into.length) throw new Error("the volume is longer than its grid");
    into.set(value, arrived);
    arrived += value.length;
    told(arrived);
  }
  if (arrived !== into.length) throw new Error("the volume is shorter than its grid");
  return true;
}

/** @param {string} part @param {string} key @returns {Promise<ArrayBuffer|null>} */
export async function readSurface(part, key) {
  const answer = await ask(`/api/surface/${encodeURIComponent(part)}/${encodeURIComponent(key)}`).catch(() => null);
  return answer?.ok && answer.status !== outdated ? answer.arrayBuffer() : null;
}

/**
 * The lines of a plane; `undefined` when the server could not be asked, null when it has none under this key.
 * @param {string} address of the plane @param {AbortSignal} signal
 * @returns {Promise<{name: string, points: number[][][]}[]|null|undefined>}
 */
export async function readLines(address, signal) {
  try {
    const answer = await ask(`/api/lines/${address}`, { signal });
    if (answer.status === outdated) await poll();
    else if (answer.ok) return (await answer.json()).lines;
    return null;
  } catch {
    return undefined;
  }
}

/** Reads the log into the state; a lost answer is made good by the next. */
export async function readLog() {
  const answer = await ask("/api/log").catch(() => null);
  if (!answer?.ok) return;
  const told = await answer.json().catch(() => null);
  if (told) change({ log: told.lines });
}

export const refresh = () => poll();

/** Asks for the state once. @returns {Promise<"live"|"gone"|"refused">} */
async function poll() {
  try {
    const answer = await timely(ask("/api/state"));
    if (answer.status === 401) return "refused";
    if (!answer.ok) return "gone";
    change({ server: await answer.json(), link: "live" });
    return "live";
  } catch {
    return "gone";
  }
}

/** @type {WebSocket|null} */
let open = null;
/** @type {(frame: ArrayBuffer) => void} */
let framed = () => {};

/** Frames of the live picture go to one listener. @param {(frame: ArrayBuffer) => void} listener */
export const followFrames = (listener) => { framed = listener; };

/** @type {(told: import("./state.js").Navigation) => void} */
let navigated = () => {};
/** What a navigation says goes to one listener. @param {(told: import("./state.js").Navigation) => void} listener */
export const followNavigation = (listener) => { navigated = listener; };

/** Tells the server something by the socket, when there is one. @param {object} what */
export const tell = (what) => open?.send(JSON.stringify(what));

/** Follows the server's events until the socket closes; tells whether any came. @returns {Promise<boolean>} */
function listen() {
  return new Promise((done) => {
    let heard = false;
    const socket = new WebSocket(`ws://${location.host}/api/link`);
    const ping = setInterval(() => socket.readyState === WebSocket.OPEN && socket.send('{"ping":1}'), 20_000);
    socket.binaryType = "arraybuffer";
    socket.onopen = () => socket.send(JSON.stringify({ token: token() }));
    socket.onmessage = (event) => {
      if (event.data instanceof ArrayBuffer) return framed(event.data);
      const told = JSON.parse(event.data);
      if (told.navigation) return navigated(told.navigation);
      if (!told.state) return;
      heard = true;
      open = socket;
      change({ server: told.state, link: "live", socket: true });
    };
    socket.onclose = () => {
      clearInterval(ping);
      open = null;
      change({ socket: false, navigation: null });
      done(heard);
    };
  });
}

/** Keeps the state up to date for as long as the page lives: by the socket, or by asking every second where none can be had. */
export async function follow() {
  let heard = true;
  for (let round = 0; ; round++) {
    if (heard || round % 10 === 0) heard = await listen();
    const link = await poll();
    change({ link });
    if (link === "refused") return;
    if (link === "gone") heard = true;
    await pause(link === "gone" ? 2_000 : 1_000);
  }
}
