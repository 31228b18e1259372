// The picture says everything to those who see it; the same in words to a screen reader, and to everybody that the program has ended.
const words = document.getElementById('words');
const ended = document.getElementById('ended');

async function look() {
  try {
    const answer = await fetch('/words');
    const text = await answer.text();
    if (text !== words.textContent) words.textContent = text;
    if (!ended.hidden) location.reload(); // started again with the same port
  } catch {
    ended.hidden = false;
  }
  setTimeout(look, 500);
}
look();
