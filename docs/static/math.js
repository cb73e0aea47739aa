/* Render the formulas, which Sphinx writes as \(...\) and \[...\], as MathML, by KaTeX. */
document.addEventListener("DOMContentLoaded", () => {
  for (const each of document.querySelectorAll(".math")) {
    const text = each.textContent.trim().replace(/^\\[[(]|\\[\])]$/g, "");
    katex.render(text, each, { displayMode: each.tagName === "DIV", output: "mathml" });
  }
});
