"""How the page of the report looks: its style sheet, and the few lines of script for folds."""

STYLE = """
:root { color-scheme: light dark; --ink: #1d2125; --soft: #4d5560; --ground: #ffffff; --card: #f4f5f7;
  --line: #d0d4da; --link: #0b57a4; --bad: #9c3000; --shadow: rgb(0 0 0 / 28%); }
@media (prefers-color-scheme: dark) {
  :root { --ink: #e6e8eb; --soft: #b3bac4; --ground: #15181c; --card: #20242a; --line: #3d444d;
    --link: #8ab8f0; --bad: #ff9e70; --shadow: rgb(255 255 255 / 35%); }
}
* { box-sizing: border-box; }
body { margin: 0; font: 1rem/1.5 system-ui, sans-serif; color: var(--ink); background: var(--ground); }
a { color: var(--link); }
code { font-size: 0.9em; overflow-wrap: anywhere; }
summary { cursor: pointer; }
sub, sup { line-height: 0; }
header, footer, .contents, main { padding: 0 1rem; }
header p { max-width: 50rem; }
h1 { margin: 1.2rem 0 0.3rem; }
h2 { margin: 0; display: inline; font-size: 1.35rem; }
h3 { margin: 0 0 0.6rem; font-size: 1rem; line-height: 1.35; }
.soft, .made, .reading { color: var(--soft); font-size: 0.9rem; }
.failed { color: var(--bad); }
section { margin: 2rem 0 0; border-top: 1px solid var(--line); padding-top: 1rem; }
.findings { background: var(--card); border: 1px solid var(--line); border-radius: 8px; padding: 1rem;
  margin-top: 0; }
.findings h2, .findings h3 { display: block; margin: 0 0 0.5rem; }
dl { display: grid; gap: 0.2rem 1.5rem; margin: 0 0 1rem; }
dt { font-weight: 600; margin-top: 0.5rem; }
dd { margin: 0; }
.advice h2 { display: block; margin: 1.5rem 0 0.5rem; }
.advice p, .advice li { max-width: 50rem; margin: 0 0 0.4rem; }
.contents ul { list-style: none; margin: 0.2rem 0 0.6rem; padding: 0; }
.contents li { margin: 0.1rem 0; line-height: 1.35; }
.contents li li { margin-left: 0.8rem; font-size: 0.88rem; }
.plates { display: grid; grid-template-columns: minmax(0, 1fr); gap: 1.5rem; align-items: start;
  margin-top: 1rem; }
figure { margin: 0; min-width: 0; }
figure.table { grid-column: 1 / -1; }
figcaption { margin-top: 0.5rem; }
figcaption p { margin: 0 0 0.4rem; }
.plate { display: block; background: #ffffff; border: 1px solid var(--line); border-radius: 6px;
  padding: 2px; overflow: hidden; }
.plate img { display: block; width: 100%; height: auto; }
.box { overflow: auto; max-height: 26rem; border: 1px solid var(--line); border-radius: 6px;
  /* a shadow at the edge behind which there is more */
  background:
    linear-gradient(to right, var(--ground) 40%, transparent) left / 2.5rem 100% local,
    linear-gradient(to left, var(--ground) 40%, transparent) right / 2.5rem 100% local,
    linear-gradient(to right, var(--shadow), transparent) left center / 1.1rem calc(100% - 4px) scroll,
    linear-gradient(to left, var(--shadow), transparent) right center / 1.1rem calc(100% - 4px) scroll;
  background-repeat: no-repeat; }
.findings .box { --ground: var(--card); }
.whole { max-height: none; }
table { border-collapse: collapse; font-size: 0.85rem; width: 100%; }
td, th { padding: 0.25rem 0.7rem; text-align: left; vertical-align: top;
  border-bottom: 1px solid var(--line); }
th { position: sticky; top: 0; background: var(--card); }
td.number { font-variant-numeric: tabular-nums; white-space: nowrap; }
@media (max-width: 40rem) {
  .cards { border: 0; max-height: none; overflow: visible; background: none; }
  .cards thead { display: none; }
  .cards table, .cards tbody, .cards tr { display: block; }
  .cards tr { border: 1px solid var(--line); border-radius: 6px; margin: 0 0 0.8rem; padding: 0.4rem 0.7rem; }
  .cards td { display: block; border: 0; padding: 0.15rem 0; }
  .cards td::before { content: attr(data-column) ": "; color: var(--soft); }
  .cards td:empty { display: none; }
}
/* figures in rows of two or three; the last one, if alone in its row, has its words beside it */
@media (min-width: 44.5rem) { .plates { grid-template-columns: repeat(2, minmax(0, 1fr)); } }
@media (min-width: 83rem) { .plates { grid-template-columns: repeat(3, minmax(0, 1fr)); } }
@media (min-width: 44.5rem) and (max-width: 82.99rem) {
  .lone-2 { grid-column: 1 / -1; display: grid; grid-template: auto 1fr / 1fr 1fr; gap: 0 1.5rem; }
  .lone-2 .plate { grid-area: 1 / 1 / 3 / 2; align-self: start; }
}
@media (min-width: 83rem) {
  .lone-3 { grid-column: 1 / -1; display: grid; grid-template: auto 1fr / 1fr 1fr; gap: 0 1.5rem; }
  .lone-3 .plate { grid-area: 1 / 1 / 3 / 2; align-self: start; }
}
@media (min-width: 64rem) {
  .columns { display: grid; grid-template-columns: 15rem minmax(0, 1fr); gap: 1rem; max-width: 110rem; }
  .contents { position: sticky; top: 0; align-self: start; max-height: 100vh; overflow: auto; }
  dl { grid-template-columns: 8rem 1fr; max-width: 60rem; }
  dt { margin: 0; }
}
@media print {
  .box { max-height: none; }
  .contents { display: none; }
  .columns { display: block; }
}
"""
# small screens begin with the sections folded; a link into one of them opens it
SCRIPT = """
const folds = document.querySelectorAll("details.fold");
if (matchMedia("(max-width: 63.99rem)").matches) folds.forEach(one => { one.open = false; });
const reveal = () => {
  const aim = location.hash && document.getElementById(decodeURIComponent(location.hash.slice(1)));
  if (!aim) return;
  for (let one = aim; one; one = one.parentElement) if (one.tagName === "DETAILS") one.open = true;
  aim.scrollIntoView();
};
addEventListener("hashchange", reveal);
addEventListener("load", reveal);
addEventListener("beforeprint", () => folds.forEach(one => { one.open = true; }));
"""
