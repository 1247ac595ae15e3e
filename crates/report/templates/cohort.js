document.documentElement.classList.add("live");
const find = (id) => document.getElementById(id);
const list = find("cards");
if (list) {
  const cards = Array.from(list.children, (card) => ({
    card,
    text: card.textContent.toLowerCase(),
    codes: card.dataset.codes.split(" "),
    keys: card.dataset.keys.split(";"),
  }));
  const boxes = Array.from(document.querySelectorAll("[data-show]"));
  const show = () => {
    const ended = new Set(boxes.filter((box) => box.checked).map((box) => box.dataset.show));
    const words = find("text").value.toLowerCase().split(/\s+/).filter(Boolean);
    const code = find("code").value;
    let shown = 0;
    for (const { card, text, codes } of cards) {
      const fits = ended.has(card.dataset.ended) && (!code || codes.includes(code)) && words.every((word) => text.includes(word));
      card.hidden = !fits;
      shown += fits;
    }
    find("shown").textContent = shown === cards.length ? `all ${shown}` : `${shown} of ${cards.length}`;
  };
  const sort = () => {
    const order = find("order").value;
    // Without a figure: last. The verdict counts from the worst up, figures from the largest down.
    const key = ({ keys }) => (keys[order] === "" ? -Infinity : Number(keys[order]));
    const sorted = cards.slice();
    if (order === "0") sorted.sort((a, b) => key(a) - key(b));
    else if (order !== "name") sorted.sort((a, b) => (key(b) > key(a)) - (key(b) < key(a)));
    list.append(...sorted.map(({ card }) => card));
  };
  for (const box of [...boxes, find("text"), find("code")]) box.addEventListener("input", show);
  find("order").addEventListener("change", sort);
  document.querySelector("form.tools").addEventListener("submit", (event) => event.preventDefault());
  // A link leads to a patient whom a filter hides: all are shown then.
  window.addEventListener("hashchange", () => {
    const wanted = find(decodeURIComponent(location.hash.slice(1)));
    if (wanted && wanted.hidden) {
      for (const box of boxes) box.checked = true;
      find("text").value = find("code").value = "";
      show();
      wanted.scrollIntoView();
    }
  });
  show();
}
