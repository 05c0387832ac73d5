'use strict';
// A page that fails must say so: to the reader, and to tests/report_browser_test.cpp by the data attribute.
function reportFailure(message) {
  document.body.dataset.errors = `${document.body.dataset.errors || ''}${message}\n`;
  const notice = document.createElement('p');
  notice.className = 'notice';
  notice.textContent = `This page failed: ${message}`;
  document.body.prepend(notice);
}
// Browsers report a delayed resize notification as an error of the page; it is none.
window.addEventListener('error', (event) => {
  if (!String(event.message).includes('ResizeObserver')) reportFailure(event.message);
});
window.addEventListener('unhandledrejection', (event) => reportFailure(event.reason));
document.addEventListener(
    'securitypolicyviolation', (event) => reportFailure(`${event.violatedDirective}: ${event.blockedURI}`));
