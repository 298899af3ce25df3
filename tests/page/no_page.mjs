// What modules of the page read of a browser when they are imported.

globalThis.matchMedia = () => ({ matches: false });
