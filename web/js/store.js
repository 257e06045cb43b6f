/** A frozen object that is replaced as a whole, and those who listen for changes of its fields. */

/** Whether two values hold the same; what is the same object is not looked into, for answers are large. */
function same(a, b) {
  if (Object.is(a, b)) return true;
  if (a === null || b === null || typeof a !== "object" || typeof b !== "object") return false;
  if (a instanceof Error || b instanceof Error || Array.isArray(a) !== Array.isArray(b)) return false;
  const keys = Object.keys(a);
  return keys.length === Object.keys(b).length && keys.every((key) => Object.hasOwn(b, key) && same(a[key], b[key]));
}

/**
 * A store. `set(patch)` replaces fields and tells listeners of those that changed; `on(fields, listener)` calls
 * listener(state, changed) after changes of any of the fields ("*" for all) and returns a function that ends it.
 * @template {object} State
 * @param {State} initial
 */
export function createStore(initial) {
  let state = Object.freeze({ ...initial });
  const listeners = new Set();
  return {
    get: () => state,
    set(patch) {
      const changed = new Set(Object.keys(patch).filter((key) => !same(state[key], patch[key])));
      if (changed.size === 0) return;
      state = Object.freeze({ ...state, ...patch });
      for (const one of listeners) {
        if (one.fields === "*" || one.fields.some((field) => changed.has(field))) one.listener(state, changed);
      }
    },
    on(fields, listener) {
      const one = { fields, listener };
      listeners.add(one);
      return () => listeners.delete(one);
    },
  };
}
