// The stream of states; reconnects when the connection ends.

import { BASE, protocols, read } from "./api.js";

const SILENT_MS = 4000; // states come five times a second
const PAUSES_MS = [300, 1000, 2000, 4000];

export function follow(onState, onConnection, base = BASE) {
  let failures = 0;

  function connect() {
    const scheme = location.protocol === "https:" ? "wss" : "ws";
    const socket = new WebSocket(`${scheme}://${location.host}${base}/v1/live`, protocols());
    let refused = true; // until a state comes
    let watchdog = setTimeout(() => socket.close(), SILENT_MS);
    let ended = false;

    socket.onmessage = (event) => {
      clearTimeout(watchdog);
      watchdog = setTimeout(() => {
        end(); // a dead link may take minutes to report its own close
        socket.close();
      }, SILENT_MS);
      failures = 0;
      refused = false;
      onConnection(true);
      onState(JSON.parse(event.data));
    };
    socket.onclose = end;

    async function end() {
      if (ended) return;
      ended = true;
      clearTimeout(watchdog);
      socket.onmessage = null;
      onConnection(false);
      // A socket does not say why it was refused; a request does, and asks for the token.
      if (refused) await read("/v1/status").catch(() => {});
      setTimeout(connect, PAUSES_MS[Math.min(failures, PAUSES_MS.length - 1)]);
      failures += 1;
    }
  }

  connect();
}
