// A link into something folded unfolds it, and so does printing; without script both still work by hand.
const unfold = () => {
  const target = location.hash && document.getElementById(location.hash.slice(1));
  for (let part = target; part; part = part.parentElement) if (part.tagName === 'DETAILS') part.open = true;
  if (target) target.scrollIntoView();
};
addEventListener('hashchange', unfold);
addEventListener('load', unfold);
addEventListener('beforeprint', () =>
  document.querySelectorAll('details:not(.subjects)').forEach((part) => { part.open = true; }));
