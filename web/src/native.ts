// Whether a program is the engine: `domelight view` says so in the page that it serves.

const { content } = document.querySelector<HTMLMetaElement>("meta[name=native]")!;

/** The files of the disk that the program opens by their names; null if the page has engines of its own. */
export const files: string[] | null = content ? JSON.parse(content) : null;

/** The address of the program's socket. */
export const socket = () => new URL("engine", location.href.replace(/^http/, "ws").replace(/[?#].*/, "")).href;
