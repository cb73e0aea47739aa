// Calls `send` with the newest value, but no oftener than every REST milliseconds, and with AHEAD values at most since a picture
// came: a server that is slower than the hand is not left with a queue.  A picture that does not come is not waited for longer
// than LOST.  The last value is always sent.
const REST = 33, AHEAD = 2, LOST = 300, CAME = "limitsets:picture"
function paced(model, send) {
  let newest, due = false, sent = -REST, ahead = 0, timer = 0
  const go = () => {
    clearTimeout(timer)
    if (!due) return
    const left = sent + (ahead < AHEAD ? REST : LOST) - performance.now()
    if (left > 0) { timer = setTimeout(go, left); return }
    due = false
    sent = performance.now()
    ahead = ahead < AHEAD ? ahead + 1 : 1
    send(newest)
  }
  const came = () => { ahead = 0; go() }
  document.addEventListener(CAME, came)
  model.on("remove", () => document.removeEventListener(CAME, came))
  return (value) => { newest = value; due = true; go() }
}
