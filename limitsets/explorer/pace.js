// Calls `send` with the newest value at once, but no oftener than every REST milliseconds; the last value is never lost.
const REST = 33
function paced(send) {
  let newest, waiting = false, sent = -REST
  const go = () => { waiting = false; sent = performance.now(); send(newest) }
  return (value) => {
    newest = value
    if (waiting) return
    const left = sent + REST - performance.now()
    if (left <= 0) go()
    else { waiting = true; setTimeout(go, left) }
  }
}
