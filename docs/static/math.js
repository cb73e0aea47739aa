/* Render the formulas, which Sphinx writes as \(...\) and \[...\], as MathML, by KaTeX. */
document.addEventListener("DOMContentLoaded", () => {
  for (const each of document.querySelectorAll(".math")) {
    const text = each.textContent.trim().replace(/^\\[[(]|\\[\])]$/g, "");
    katex.render(text, each, { displayMode: each.tagName === "DIV", output: "mathml" });
    mend(each);
    const right = each.getBoundingClientRect().right;
    if (!each.closest("table") && right > document.documentElement.clientWidth) each.classList.add("wide");
  }
});

/* Browsers leave no room between a function and its argument, and without a font for mathematics they raise a prime,
   which is high already, once more. */
function mend(formula) {
  for (const apply of formula.querySelectorAll("mo")) {
    const next = apply.nextElementSibling;
    if (apply.textContent === "\u2061" && next && !next.textContent.startsWith("(")) {
      apply.setAttribute("lspace", "0");
      apply.setAttribute("rspace", "0.17em");
    }
  }
  for (const raised of formula.querySelectorAll("msup")) {
    const [base, primes] = raised.children;
    if (!/^\u2032+$/.test(primes.textContent)) continue;
    const row = document.createElementNS(raised.namespaceURI, "mrow");
    const mark = document.createElementNS(raised.namespaceURI, "mi");
    mark.textContent = primes.textContent.replaceAll("\u2032", "\u02b9");
    row.append(base, mark);
    raised.replaceWith(row);
  }
}
