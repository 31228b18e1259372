// The other pictures of the project's folder, and photos from elsewhere, which can be added.

import { api } from "./api.js";
import { button, by, element } from "./elements.js";
import { adoptFrom } from "./server_end.js";
import { changed, isLive, state } from "./store.js";
import { adoptPhoto, adoptTrial, openImage, openTrialPicture } from "./strip.js";
import { openTab } from "./tabs.js";
import { toast } from "./toast.js";
import { byName, listText } from "./words.js";

const dialog = by("folder");
/** Role of a chosen picture: photo or try. */
let wanted = "photo";

/** The pictures offered for a role, by name. A removed demonstration may be a copy of a picture to try; it is then not offered for trying. */
const offered = (role) => state.others.filter(({ is_tried: isTried }) => role === "photo" || !isTried).sort(byName);

const isWithoutPhoto = () => !state.images.length && !state.camera;

const refresh = () => adoptFrom(api.session());

function took(view) {
  openTab("mark");
  openImage(adoptPhoto(view));
}

/** Runs an operation that adds pictures and reports its errors. */
async function take(work) {
  await work().catch((error) => toast(error.message));
  // If the server is gone, a banner says so.
  await refresh().catch(() => null);
  render();
  changed();
}

const takePhoto = (id) => take(async () => {
  took(await api.addPhoto(id));
  dialog.close();
});

/** Adds pictures to try, without those that cannot be read, and shows the first of them. */
const takeTrials = (ids) => take(async () => {
  const first = state.trialPictures.length;
  const errors = [];
  for (const id of ids) {
    const trial = await api.addOtherTrial(id).catch((error) => void errors.push(error));
    if (trial) adoptTrial(trial);
    if (errors.at(-1)?.lost) break;
  }
  openTrialPicture(first);
  if (errors.length) toast(listText(errors.map(({ message }) => message), 3));
});

/** A photo from elsewhere is copied beside the first photo. */
export const uploadPhoto = (file) => take(async () => {
  took(await api.uploadPhoto(file));
  dialog.close();
});

function render() {
  const isPhoto = wanted === "photo";
  by("folder-title").textContent = isPhoto ? (state.images.length ? "Add a photo of the part" : "Which picture is the photo of the part?") : "Pictures of this folder";
  const others = offered(wanted);
  by("folder-how").textContent = !others.length
    ? "There is no other picture in the project’s folder."
    : isPhoto
      ? "The best one shows the part whole and alone, nothing over it. The others can be tried later."
      : "Choose those to try the model on.";
  const all = others.length > 1 && !isPhoto;
  by("folder-all").hidden = !all;
  by("folder-all").textContent = `Add all ${others.length}`;
  by("folder-choose").hidden = !isPhoto;
  by("folder-list").replaceChildren(...others.map(({ id, name }) => {
    const item = element("li");
    const choose = button("", () => (isPhoto ? takePhoto(id) : takeTrials([id])));
    const picture = element("img", { alt: "", loading: "lazy", src: api.otherUrl(id) });
    choose.append(picture, element("span", { textContent: name }));
    item.append(choose);
    return item;
  }));
}

export async function openFolder(as) {
  wanted = as;
  await refresh().catch(() => null);
  render();
  dialog.showModal();
}

by("folder-all").addEventListener("click", () => {
  dialog.close();
  takeTrials(offered(wanted).map(({ id }) => id));
});
by("folder-choose").addEventListener("click", () => by("photo-input").click());
by("photo-input").addEventListener("change", () => {
  const [file] = by("photo-input").files;
  by("photo-input").value = "";
  if (file) uploadPhoto(file);
});
for (const id of ["add-photo", "choose-photo"]) by(id).addEventListener("click", () => openFolder("photo"));
by("add-others").addEventListener("click", () => openFolder("try"));

export function renderFolder() {
  by("choose").hidden = !isWithoutPhoto();
  by("mark-work").hidden = isWithoutPhoto() || (isLive() && state.tab === "mark");
  const { length } = offered("try");
  by("add-others").hidden = !length;
  by("add-others").textContent = `From this folder (${length})…`;
}

by("projects").addEventListener("click", async () => {
  try {
    await api.closeProject();
    location.reload();
  } catch (error) {
    toast(error.message);
  }
});
