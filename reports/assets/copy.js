// Texts for the clipboard: command lines, and the button that copies them.

import {make} from './page.js';

export const shellQuote = (text) => (/^[\w./@%+=:,-]+$/.test(text) ? text : `'${text.replaceAll('\'', '\'\\\'\'')}'`);

async function copyText(text, button) {
  try {
    await navigator.clipboard.writeText(text);
  } catch {
    // A page opened from a file may have no clipboard: select and copy, as before there was one.
    const area = make('textarea', {class: 'offscreen'});
    area.value = text;
    document.body.append(area);
    area.select();
    document.execCommand('copy');
    area.remove();
  }
  const label = button.textContent;
  button.textContent = 'Copied';
  setTimeout(() => (button.textContent = label), 1200);
}

export const copyButton = (text, label = 'Copy command') => make(
    'button', {type: 'button', class: 'copy no-print', title: text, onclick: (e) => copyText(text, e.target)}, label);
