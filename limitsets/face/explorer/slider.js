// The browser's own slider: a library's costs the page more for a move than a picture does.
export function render({ model, el }) {
  const label = document.createElement("label"), words = document.createElement("span"), bar = document.createElement("input")
  bar.type = "range"
  label.append(words, bar)
  el.append(label)
  const fit = () => {
    words.textContent = model.label
    Object.assign(bar, { min: model.start, max: model.end, step: model.step })
    bar.value = model.value
  }
  const send = paced(model, (value) => { model.value = value })
  bar.addEventListener("input", () => send(Number(bar.value)))
  model.on(["start", "end", "step", "label"], fit)
  model.on("value", () => { if (Number(bar.value) !== model.value) bar.value = model.value })
  fit()
}
