"use strict";
{
  const folds = [...document.querySelectorAll("details.claim")];
  const settled = [...document.querySelectorAll("details.settled")];
  const rows = [...document.querySelectorAll("details.claim tr[data-status]")];
  const [status, run, count] = ["by-status", "by-run", "shown"].map((id) => document.getElementById(id));

  const filter = () => {
    for (const row of rows) {
      row.hidden = (status.value && row.dataset.status !== status.value) || (run.value && row.dataset.run !== run.value);
    }
    for (const fold of folds) {
      fold.hidden = !fold.querySelector("tr[data-status]:not([hidden])");
    }
    for (const several of settled) {
      several.hidden = !several.querySelector("details.claim:not([hidden])");
      several.open ||= Boolean(status.value || run.value);
    }
    count.textContent = `${folds.filter((fold) => !fold.hidden).length} of ${folds.length} claims`;
  };

  const reveal = (id) => {
    const target = document.getElementById(id) || document.getElementById(decodeURIComponent(id));
    if (!target) return;
    for (let fold = target.closest("details"); fold; fold = fold.parentElement.closest("details")) {
      fold.open = true;
      fold.hidden = false;
    }
    target.scrollIntoView();
  };

  if (status) {
    for (const each of [status, run]) each.addEventListener("change", filter);
    for (const [id, open] of [["open-all", true], ["close-all", false]]) {
      document.getElementById(id).addEventListener("click", () => [...folds, ...settled].forEach((fold) => { fold.open = open; }));
    }
    document.getElementById("tools").hidden = false;
    filter();
  }
  document.addEventListener("click", (event) => {
    const link = event.target.closest("a[href^='#']");
    if (link) reveal(link.getAttribute("href").slice(1));
  });
  window.addEventListener("hashchange", () => reveal(location.hash.slice(1)));
  if (location.hash) reveal(location.hash.slice(1));
}
