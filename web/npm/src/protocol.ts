// Messages between the caller's thread and a Worker.

/** A call, answered by one result or error. */
export interface Request {
  id: number;
  call: string;
  arguments: unknown[];
}

export type Reply =
  | { id: number; progress: number }
  | { id: number; result: unknown }
  /** `fatal` says that the engine is of no use any more. */
  | { id: number; error: string; fatal: boolean };

/** The call that reports its progress: to a function that is its last argument. */
export const REPORTING = "render";
