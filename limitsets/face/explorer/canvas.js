// Draws what a `Canvas` of canvas.py lists, layer upon layer, once a frame of the screen at most.  Scripts of a reader, and
// tests, find on the canvas itself what it shows (`shown`) and where (`frame`, and the `boxes` of words).
const FACE = 'system-ui, -apple-system, "Segoe UI", "DejaVu Sans", sans-serif'
const INK = "#222222", TILE = 8, NEAR = 24, MOVED = 4, NARROW = 480, LOW = 120, HIGH = 420

export function render({ model, el }) {
  const canvas = document.createElement("canvas"), pen = canvas.getContext("2d"), tiles = new Map()
  Object.assign(canvas.style, { display: "block", width: "100%", height: "100%", touchAction: "pan-y" })
  canvas.dataset.name = model.called
  canvas.setAttribute("role", "img")
  el.append(canvas)
  let due = false, boxes = []

  // ---------------------------------------------------------------- where things are
  const framed = (view) => {
    const [left, right, top, bottom] = view.margins
    const frame = { left, top, width: canvas.clientWidth - left - right, height: canvas.clientHeight - top - bottom }
    let [[x0, x1], [y0, y1]] = [view.x, view.y]
    if (view.equal) {
      const scale = Math.max((x1 - x0) / frame.width, (y1 - y0) / frame.height)
      const [x, y, across, up] = [(x0 + x1) / 2, (y0 + y1) / 2, (scale * frame.width) / 2, (scale * frame.height) / 2]
      ;[x0, x1, y0, y1] = [x - across, x + across, y - up, y + up]
    }
    return { ...frame, x0, x1, y0, y1 }
  }
  const across = (x) => { const f = canvas.frame; return f.left + ((x - f.x0) / (f.x1 - f.x0)) * f.width }
  const down = (y) => { const f = canvas.frame; return f.top + ((f.y1 - y) / (f.y1 - f.y0)) * f.height }

  // ---------------------------------------------------------------- kinds of layers
  const hatched = (hatch) => {
    if (!tiles.has(hatch)) {
      const tile = document.createElement("canvas"), on = tile.getContext("2d"), n = TILE
      tile.width = tile.height = n
      Object.assign(on, { strokeStyle: INK, fillStyle: INK, globalAlpha: 0.5, lineWidth: 1 })
      const line = (a, b, c, d) => { on.moveTo(a, b); on.lineTo(c, d) }
      on.beginPath()
      if (hatch === "/" || hatch === "x") { line(-1, n + 1, n + 1, -1); line(-1, 1, 1, -1); line(n - 1, n + 1, n + 1, n - 1) }
      if (hatch === "\\" || hatch === "x") { line(-1, -1, n + 1, n + 1); line(-1, n - 1, 1, n + 1); line(n - 1, -1, n + 1, 1) }
      if ("|+*".includes(hatch)) line(n / 2 + 0.5, 0, n / 2 + 0.5, n)
      if ("-+*".includes(hatch)) line(0, n / 2 + 0.5, n, n / 2 + 0.5)
      if (hatch === "o") on.arc(n / 2, n / 2, n / 3, 0, 7)
      on.stroke()
      if (hatch === ".") on.fillRect(n / 2 - 1, n / 2 - 1, 2, 2)
      tiles.set(hatch, pen.createPattern(tile, "repeat"))
    }
    return tiles.get(hatch)
  }
  const kinds = {
    bars: ({ left, right, bottom, top, face, hatch, line }) => {
      pen.lineWidth = 1
      left.forEach((x, k) => {
        const box = [across(x), down(top[k]), Math.max(across(right[k]) - across(x), 1), down(bottom[k]) - down(top[k])]
        pen.fillStyle = face[k]
        pen.fillRect(...box)
        if (hatch[k] !== " ") { pen.fillStyle = hatched(hatch[k]); pen.fillRect(...box) }
        pen.strokeStyle = line || face[k]
        pen.strokeRect(...box)
      })
    },
    strokes: ({ x, y0, y1, line, width }) => {
      pen.strokeStyle = line
      pen.lineWidth = width
      pen.beginPath()
      x.forEach((each, k) => { pen.moveTo(across(each), down(y0[k])); pen.lineTo(across(each), down(y1[k])) })
      pen.stroke()
    },
    path: ({ x, y, line, width, dash, fill }) => {
      if (!x.length) return
      pen.beginPath()
      x.forEach((each, k) => pen.lineTo(across(each), down(y[k])))
      if (fill) { pen.closePath(); pen.fillStyle = fill; pen.fill() }
      pen.strokeStyle = line
      pen.lineWidth = width
      pen.setLineDash(dash || [])
      pen.stroke()
      pen.setLineDash([])
    },
    marks: ({ x, y, shape, size, fill, line, width }) => {
      const r = size / 2
      x.forEach((each, k) => {
        const [h, v] = [across(each), down(y[k])]
        pen.beginPath()
        if (shape === "diamond") [[0, -r], [0.75 * r, 0], [0, r], [-0.75 * r, 0]].forEach(([a, b]) => pen.lineTo(h + a, v + b))
        else if (shape === "triangle") [[-r, -r], [r, -r], [0, r]].forEach(([a, b]) => pen.lineTo(h + a, v + b))
        else if (shape === "square") pen.rect(h - r, v - r, size, size)
        else pen.arc(h, v, r, 0, 7)
        pen.closePath()
        pen.fillStyle = fill
        pen.fill()
        if (shape === "cross") { pen.moveTo(h - r, v); pen.lineTo(h + r, v); pen.moveTo(h, v - r); pen.lineTo(h, v + r) }
        pen.strokeStyle = line
        pen.lineWidth = width
        pen.stroke()
      })
    },
    // A word stays within the picture, and `apart` keeps it off the words before it; a narrow picture has the `short` ones.
    words: ({ x, y, words, short, align, colour, size, plate, shift, apart, baseline }) => {
      pen.font = `${size}px ${FACE}`
      pen.textBaseline = "middle"
      pen.textAlign = "left"
      const chosen = short && canvas.clientWidth < NARROW ? short : words
      chosen.forEach((word, k) => {
        if (!word) return
        const wide = pen.measureText(word).width, high = size + 2
        const part = { left: 0, right: 1, center: 0.5 }[Array.isArray(align) ? align[k] : align]
        const h = Math.max(1, Math.min(across(x[k]) + (shift || 0) - part * wide, canvas.clientWidth - wide - 1))
        const from = down(y[k]) + (baseline === "top" ? high / 2 + 1 : 0)
        const free = (v) => !boxes.some((box) =>
          h < box.h + box.wide + 3 && box.h < h + wide + 3 && Math.abs(v - box.v) < (high + box.high) / 2)
        const steps = apart ? [0, high, -high, 2 * high, -2 * high] : [0]
        const v = from + (steps.find((step) => free(from + step)) ?? 0)
        boxes.push({ h, v, wide, high })
        if (plate) { pen.fillStyle = "#ffffffd8"; pen.fillRect(h - 1, v - high / 2, wide + 2, high) }
        pen.fillStyle = colour
        pen.fillText(word, h, v)
      })
    },
    // Many points, as pairs of numbers of 16 bits from edge to edge of the view: a pixel each, and the one beside and below it.
    dots: ({ packed, colour }) => {
      const bytes = Uint8Array.from(atob(packed), (each) => each.charCodeAt(0)), at = new Uint16Array(bytes.buffer)
      const f = canvas.frame, ratio = canvas.width / canvas.clientWidth
      const wide = Math.floor(f.width * ratio), high = Math.floor(f.height * ratio)
      if (!at.length || wide < 2 || high < 2) return
      const image = pen.createImageData(wide, high), pixels = new Uint32Array(image.data.buffer)
      const ink = parseInt(colour.slice(1).match(/../g).reverse().join(""), 16) | 0xff000000  // bytes stand as A, B, G, R
      for (let k = 0; k < at.length; k += 2) {
        const h = Math.round((at[k] / 65535) * (wide - 2)), v = Math.round((1 - at[k + 1] / 65535) * (high - 2))
        const first = v * wide + h
        pixels[first] = pixels[first + 1] = pixels[first + wide] = pixels[first + wide + 1] = ink
      }
      pen.putImageData(image, Math.round(f.left * ratio), Math.round(f.top * ratio))
    },
  }

  // ---------------------------------------------------------------- axes
  const ticks = (lo, hi, count) => {
    const rough = (hi - lo) / Math.max(count, 1), ten = 10 ** Math.floor(Math.log10(rough))
    const step = [1, 2, 5, 10].map((each) => each * ten).find((each) => each >= rough - 1e-9 * ten)
    const digits = Math.max(0, -Math.floor(Math.log10(step) + 1e-9)), found = []
    for (let k = Math.ceil(lo / step - 1e-9); k * step <= hi + 1e-9 * step; k++) found.push([k * step, (k * step).toFixed(digits)])
    return found
  }
  const axes = ({ across: name, up: other, lanes }) => {
    const f = canvas.frame, low = f.top + f.height
    Object.assign(pen, { strokeStyle: "#666666", fillStyle: INK, lineWidth: 1, font: `11px ${FACE}`, textBaseline: "middle" })
    pen.beginPath()
    pen.moveTo(f.left, f.top)
    pen.lineTo(f.left, low)
    pen.lineTo(f.left + f.width, low)
    pen.textAlign = "center"
    for (const [x, word] of ticks(f.x0, f.x1, f.width / 70)) {
      pen.moveTo(across(x), low)
      pen.lineTo(across(x), low + 5)
      pen.fillText(word, across(x), low + 13)
    }
    pen.fillText(name, f.left + f.width / 2, low + 28)
    pen.textAlign = "right"
    for (const [y, word] of lanes ? lanes.map((each, k) => [-k, each]) : ticks(f.y0, f.y1, f.height / 50)) {
      if (!lanes) { pen.moveTo(f.left - 5, down(y)); pen.lineTo(f.left, down(y)) }
      pen.fillText(word, f.left - 7, down(y))
    }
    pen.stroke()
    if (!lanes) { pen.textAlign = "left"; pen.fillText(other, 2, f.top - 9) }
  }

  // ---------------------------------------------------------------- painting
  const paint = () => {
    due = false
    if (canvas.shown?.view.tall) {
      const { margins: [left, right, top, bottom], tall } = canvas.shown.view
      const fits = Math.ceil((canvas.clientWidth - left - right) * tall) + top + bottom
      canvas.style.height = `${Math.min(Math.max(fits, LOW), HIGH)}px`
    }
    const ratio = window.devicePixelRatio || 1, wide = canvas.clientWidth, high = canvas.clientHeight
    if (!wide || !high || !canvas.shown) return
    if (canvas.width !== Math.round(wide * ratio) || canvas.height !== Math.round(high * ratio)) {
      canvas.width = Math.round(wide * ratio)
      canvas.height = Math.round(high * ratio)
    }
    pen.setTransform(ratio, 0, 0, ratio, 0, 0)
    pen.clearRect(0, 0, wide, high)
    const { view, heading, layers } = canvas.shown
    canvas.frame = framed(view)
    boxes = []
    if (view.across) axes(view)
    Object.assign(pen, { fillStyle: INK, font: `600 13px ${FACE}`, textAlign: "left", textBaseline: "middle" })
    const begins = Math.min(view.margins[0], wide - pen.measureText(heading).width - 4)
    pen.fillText(heading, Math.max(begins, 4), 9, wide - 8)
    for (const layer of layers) kinds[layer.kind](layer)
    canvas.boxes = boxes
  }
  const ask = () => { if (!due) { due = true; requestAnimationFrame(paint) } }
  const read = () => {
    canvas.shown = JSON.parse(model.drawn)
    canvas.setAttribute("aria-label", canvas.shown.heading)
    ask()
  }
  model.on("drawn", () => { read(); document.dispatchEvent(new Event(CAME)) })
  read()
  const watch = new ResizeObserver(ask)
  watch.observe(canvas)
  model.send_msg("seen")
  model.on("remove", () => watch.disconnect())

  // ---------------------------------------------------------------- a hand
  const at = (event) => {
    const box = canvas.getBoundingClientRect(), f = canvas.frame
    const [h, v] = [event.clientX - box.left, event.clientY - box.top]
    return { x: f.x0 + ((h - f.left) / f.width) * (f.x1 - f.x0), y: f.y1 - ((v - f.top) / f.height) * (f.y1 - f.y0), h, v }
  }
  const tell = (what, { x, y }) => model.send_msg({ what, x, y })
  const drag = paced(model, (where) => { if (pressed) tell("drag", where) })
  let pressed = null, moved = false
  canvas.addEventListener("pointerdown", (event) => {
    if (!event.isPrimary || !canvas.frame) return
    pressed = at(event)
    moved = false
    canvas.setPointerCapture(event.pointerId)
  })
  canvas.addEventListener("pointermove", (event) => {
    if (!pressed) return
    const now = at(event)
    if (!moved && Math.hypot(now.h - pressed.h, now.v - pressed.v) < MOVED) return
    if (!moved) { moved = true; tell("grasp", pressed) }
    drag(now)
  })
  canvas.addEventListener("pointerup", (event) => {
    if (pressed) {
      if (moved) { tell("drag", at(event)); tell("release", at(event)) }
      else tell("tap", at(event))
    }
    pressed = null
  })
  canvas.addEventListener("pointercancel", () => { if (pressed && moved) tell("release", pressed); pressed = null })
  // Words of the bar below a mouse that rests.
  canvas.addEventListener("pointermove", (event) => {
    const bars = canvas.shown.layers.find((layer) => layer.kind === "bars" && layer.words)
    if (!bars || !canvas.frame || pressed) return
    const { x, y } = at(event)
    const k = bars.left.findIndex((left, i) => left <= x && x < bars.right[i] && bars.bottom[i] <= y && y < bars.top[i])
    canvas.title = bars.words[k] || ""
  })
  if (canvas.shown.view.keys) {
    const steps = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }
    canvas.tabIndex = 0
    canvas.addEventListener("keydown", (event) => {
      const step = steps[event.key]
      if (step) tell("step", { x: step[0], y: step[1] })
      else if (event.key === "Enter") tell("enter", { x: 0, y: 0 })
      else return
      event.preventDefault()
    })
  }
  // A finger on what can be dragged does not scroll the page.
  canvas.addEventListener("touchstart", (event) => {
    if (!canvas.frame) return
    const { h, v } = at(event.touches[0])
    const near = (layer) => layer.grip && layer.x.some((x, k) => Math.hypot(across(x) - h, down(layer.y[k]) - v) < NEAR)
    if (canvas.shown.layers.some(near)) event.preventDefault()
  }, { passive: false })
}
