// Passes the description of the picture to screen readers, and shows that the program has ended.
const words = document.getElementById('words');
const ended = document.getElementById('ended');

async function look() {
  try {
    const answer = await fetch('/words');
    const text = await answer.text();
    if (text !== words.textContent) words.textContent = text;
    if (!ended.hidden) location.reload(); // restarted with the same port
  } catch {
    ended.hidden = false;
  }
  setTimeout(look, 500);
}
look();
