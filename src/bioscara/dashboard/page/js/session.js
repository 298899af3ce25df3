// Signing in: the token of the address for a cookie.

import { text } from "./texts.js";

/**
 * Exchange the token of the address for a cookie.
 *
 * @returns {Promise<"view" | "operate" | "admin">} The rights of this page.
 * @throws {Error} The token is wrong, or there is none.
 */
export async function signIn() {
  const token = new URLSearchParams(location.hash.slice(1)).get("token");
  if (token) {
    // Removed at once: it must not stay in the history.
    history.replaceState(null, "", location.pathname);
    const answer = await fetch("session", {
      method: "POST",
      headers: { "Content-Type": "application/json" },
      body: JSON.stringify({ token }),
    });
    if (!answer.ok) throw new Error((await answer.json()).text);
  }
  const { scope } = await (await fetch("session")).json();
  if (!scope) throw new Error(text("error.no_token"));
  return scope;
}
