// What scrolls sideways can be reached and scrolled by keyboard; a copy button is no landmark.
const reach = () => {
  document.querySelectorAll("nav.md-code__nav").forEach((one) => one.setAttribute("role", "presentation"));
  document.querySelectorAll(".md-typeset__scrollwrap, .md-typeset pre > code").forEach((one) => {
    one.tabIndex = one.scrollWidth > one.clientWidth ? 0 : -1;
  });
};
new ResizeObserver(reach).observe(document.body);
new MutationObserver(reach).observe(document.body, {childList: true, subtree: true});
