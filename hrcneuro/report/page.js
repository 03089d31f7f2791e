// A link into something folded unfolds it, and so does printing; without script both still work by hand.
const contents = document.querySelector('nav details');
const narrow = matchMedia('(max-width: 79.99rem)');
const unfold = () => {
  const target = location.hash && document.getElementById(location.hash.slice(1));
  for (let part = target; part; part = part.parentElement) if (part.tagName === 'DETAILS') part.open = true;
  if (target) target.scrollIntoView();
};
// Where the contents stand above the text, they fold away when they have been used.
const fold = () => { contents.open = !narrow.matches; };
fold();
narrow.addEventListener('change', fold);
contents.addEventListener('click', (event) => { if (event.target.tagName === 'A') fold(); });
addEventListener('hashchange', unfold);
addEventListener('load', unfold);
addEventListener('beforeprint', () =>
  document.querySelectorAll('details:not(.subjects)').forEach((part) => { part.open = true; }));
// A table that is wider than its place says so: a screen's edge alone does not tell that more follows.
const measure = () => document.querySelectorAll('.wide').forEach((place) => {
  place.classList.toggle('over', place.scrollWidth > place.clientWidth + 1);
});
measure();
addEventListener('resize', measure);
document.addEventListener('toggle', measure, true);
