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
