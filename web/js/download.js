/** Files made in the browser. */

/** Offer a text as a file. */
export function saveFile(name, text, type) {
  const url = URL.createObjectURL(new Blob([text], { type }));
  const link = document.createElement("a");
  link.href = url;
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(url), 10_000);
}

/** Offer an answer as GeoJSON. */
export const saveGeoJson = (name, answer) => saveFile(name, JSON.stringify(answer), "application/geo+json");
