import type { App } from "./app";
export class Lecture { constructor(_app: App) {} }
