// What is shown, kept in the URL's fragment: a link shows the same, and the browser's back button goes back.

/** What the fragment says of these fields: texts, '' where it says nothing. */
export function readFragment(fields) {
  const words = new URLSearchParams(location.hash.slice(1));
  return Object.fromEntries(fields.map((field) => [field, words.get(field) || '']));
}

/** A link's target. values: by field; empty ones are left out. */
export const fragmentOf = (fields, values) => '#' +
    String(new URLSearchParams(fields.filter((name) => values[name]).map((name) => [name, String(values[name])])))
        .replace(/%(2F|3A|2C)/g, decodeURIComponent);  // slash, colon and comma may stand there as they are

/** Takes the new state without a step for the back button, as for every letter of a search. */
export const replaceFragment = (fields, values) => history.replaceState(null, '', fragmentOf(fields, values));
