/** A frozen object that is replaced as a whole, and those who listen for changes of its fields. */

const same = (a, b) => a === b || JSON.stringify(a) === JSON.stringify(b);

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
