//! A folder of demonstrations of several parts.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use image::RgbImage;
use sdg_demonstration::{Demonstration, IMAGE_EXTENSIONS};
use sdg_geometry::RotationalSymmetry;
use sdg_inputs::annotation_files::{beside_photo, file_beside};
use sdg_inputs::{UNREADABLE_EXTENSIONS, demonstrations, why_unreadable};
use sdg_weights_conversion::sha256_of;

/// Name of the file with the symmetries of parts for which `--symmetry` does not apply. Each line has a part's name and
/// its symmetry: 1 to 360, or `full`.
const SYMMETRIES: &str = "symmetries.txt";
const MAX_SYMMETRIES_BYTES: u64 = 1 << 20;

/// The parts of a folder, sorted by name.
#[derive(Debug)]
pub struct DemonstrationFolder {
    pub parts: Vec<PartDemonstrations>,
    /// Photos without marks or of a format that is not read, and the reasons why they are left out.
    pub left_out: Vec<(String, String)>,
}

/// The photos of a part, with marks beside them.
#[derive(Debug, Clone)]
pub struct PartDemonstrations {
    /// The name of the photo without its extension, or the name of the folder of several photos.
    pub name: String,
    /// Photos and their marks.
    pub files: Vec<(PathBuf, PathBuf)>,
    /// The symmetry, if the folder states it.
    pub symmetry: Option<RotationalSymmetry>,
}

impl DemonstrationFolder {
    /// Reads a folder. Each photo with marks beside it is a part; each subfolder with such photos is a part as well.
    ///
    /// # Errors
    /// The folder cannot be read or has no photo with marks; two parts have the same name, or two photos the same
    /// marks; a symmetry is invalid or given for an unknown part.
    pub fn read(folder: &Path, symmetry: impl Fn(&str) -> Result<RotationalSymmetry, String>) -> Result<Self> {
        let mut found: BTreeMap<String, PartDemonstrations> = BTreeMap::new();
        let mut left_out = Vec::new();
        let mut add = |name: String, photo: PathBuf, is_own_part: bool| -> Result<()> {
            let marks = match why_unreadable(&photo) {
                None => beside_photo(&photo).map_err(|error| error.to_string()),
                Some(why) => Err(why),
            };
            let marks = match marks {
                Ok(marks) => marks,
                Err(why) => {
                    let name = photo.display().to_string();
                    let why = why.strip_prefix(&format!("{name}: ")).unwrap_or(&why).to_owned();
                    left_out.push((name, why));
                    return Ok(());
                }
            };
            match found.get_mut(&name) {
                Some(known) if is_own_part => bail!(
                    "{}: expected one part of each name, found \"{name}\" also in {}; put several photos of a part \
                     into a folder of its name",
                    photo.display(),
                    known.files[0].0.display()
                ),
                Some(known) => {
                    if let Some((other, _)) = known.files.iter().find(|(_, of_other)| *of_other == marks) {
                        bail!(
                            "{}: expected marks of its own, found {}, also the marks of {}; rename or remove one of the \
                             photos",
                            photo.display(),
                            marks.display(),
                            other.display()
                        );
                    }
                    known.files.push((photo, marks));
                }
                None => {
                    let part = PartDemonstrations { name: name.clone(), files: vec![(photo, marks)], symmetry: None };
                    found.insert(name, part);
                }
            }
            Ok(())
        };
        let name_of = |path: &Path, stem: bool| {
            let name = if stem { path.file_stem() } else { path.file_name() };
            let name = name.and_then(|name| name.to_str());
            name.map(str::to_owned).with_context(|| format!("{}: expected a name in UTF-8", path.display()))
        };
        let is_photo = |path: &Path| {
            sdg_files::has_extension(path, &IMAGE_EXTENSIONS) || sdg_files::has_extension(path, &UNREADABLE_EXTENSIONS)
        };
        for entry in sdg_files::entries(folder)? {
            if entry.is_dir() {
                let name = name_of(&entry, false)?;
                for photo in sdg_files::entries(&entry)? {
                    if is_photo(&photo) {
                        add(name.clone(), photo, false)?;
                    }
                }
            } else if is_photo(&entry) {
                add(name_of(&entry, true)?, entry, true)?;
            }
        }
        if found.is_empty() {
            bail!(
                "{}: expected photos with marks beside them, or folders of such photos, found none; `sdg annotate IMAGE` makes marks",
                folder.display()
            );
        }
        let symmetries = folder.join(SYMMETRIES);
        if symmetries.exists() {
            let text = String::from_utf8(sdg_files::read(&symmetries, MAX_SYMMETRIES_BYTES)?)
                .with_context(|| symmetries.display().to_string())?;
            for line in text.lines().filter(|line| !line.trim().is_empty()) {
                // A name can contain spaces, a symmetry cannot.
                let named = line
                    .trim()
                    .rsplit_once(char::is_whitespace)
                    .and_then(|(name, times)| Some((found.get_mut(name.trim_end())?, symmetry(times).ok()?)));
                let Some((part, times)) = named else {
                    bail!(
                        "{}: expected a part of this folder and 1 to 360 or full, found \"{line}\"",
                        symmetries.display()
                    );
                };
                part.symmetry = Some(times);
            }
        }
        Ok(Self { parts: found.into_values().collect(), left_out })
    }
}

impl PartDemonstrations {
    /// Reads the demonstrations.
    ///
    /// # Errors
    /// Photos or marks cannot be read.
    pub fn read(&self) -> Result<Vec<Demonstration>> {
        self.files.iter().map(|(photo, marks)| demonstrations::read_pair(photo, marks)).collect()
    }

    /// The first photo of the part.
    ///
    /// # Errors
    /// The photo cannot be read.
    pub fn first_photo(&self) -> Result<RgbImage> {
        sdg_inputs::read_image(&self.files[0].0)
    }

    /// Hashes of the contents of the part's files, including the files that complete the marks, such as data.yaml.
    ///
    /// # Errors
    /// Files cannot be read.
    pub fn sha256(&self) -> Result<Vec<String>> {
        let files = |(photo, marks): &(PathBuf, PathBuf)| {
            [Some(photo.clone()), Some(marks.clone()), file_beside(marks)].into_iter().flatten()
        };
        let paths = self.files.iter().flat_map(files);
        paths.map(|path| sha256_of(&path).with_context(|| path.display().to_string())).collect()
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    #[test]
    fn a_part_whose_name_has_a_space_can_have_a_symmetry() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
        for name in ["rod end.png", "rod end.json", "key.png", "key.json"] {
            write(name, "");
        }
        write(SYMMETRIES, "rod end 2\nkey\t 4 \n");
        let fold = |text: &str| text.parse::<u32>().map(RotationalSymmetry::Fold).map_err(|_| text.to_owned());
        let read = DemonstrationFolder::read(folder.path(), fold).unwrap();
        let found: Vec<_> = read.parts.iter().map(|part| (part.name.as_str(), part.symmetry)).collect();
        let [two, four] = [2, 4].map(|times| Some(RotationalSymmetry::Fold(times)));
        assert_eq!(found, [("key", four), ("rod end", two)]);
    }

    #[test]
    fn photos_that_differ_only_in_their_format_do_not_share_marks() {
        let folder = tempfile::tempdir().unwrap();
        fs::create_dir(folder.path().join("key")).unwrap();
        for name in ["a.jpg", "a.png", "a.json"] {
            fs::write(folder.path().join("key").join(name), "").unwrap();
        }
        let read = || DemonstrationFolder::read(folder.path(), |text| Err(text.to_owned()));
        let error = read().unwrap_err().to_string();
        assert!(["a.jpg", "a.png", "a.json"].iter().all(|name| error.contains(name)), "{error}");
        fs::remove_file(folder.path().join("key/a.jpg")).unwrap();
        assert_eq!(read().unwrap().parts[0].files.len(), 1);
    }

    #[test]
    fn a_photo_of_a_format_that_is_not_read_is_left_out_with_the_reason() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, bytes: &[u8]| fs::write(folder.path().join(name), bytes).unwrap();
        write("key.png", b"");
        write("key.json", b"");
        write("lever.heic", b"\0\0\0\x18ftypheic\0\0\0\0mif1heic");
        write("lever.json", b"");
        let read = DemonstrationFolder::read(folder.path(), |text| Err(text.to_owned())).unwrap();
        assert_eq!(read.parts.len(), 1);
        let [(name, why)] = read.left_out.as_slice() else { panic!("{:?}", read.left_out) };
        assert!(name.ends_with("lever.heic") && why.contains("HEIC") && !why.contains("lever.heic"), "{name}: {why}");
    }

    #[test]
    fn a_changed_data_yaml_changes_the_hashes() {
        let folder = tempfile::tempdir().unwrap();
        let [photo, marks, names] = ["key.png", "key.txt", "data.yaml"].map(|name| folder.path().join(name));
        fs::write(&photo, "").unwrap();
        fs::write(&marks, "0 0.5 0.5 0.25 0.5\n").unwrap();
        let part = PartDemonstrations { name: "key".to_owned(), files: vec![(photo, marks)], symmetry: None };
        let [first, second] = ["names: [key]\n", "names: [lock]\n"].map(|text| {
            fs::write(&names, text).unwrap();
            part.sha256().unwrap()
        });
        assert_eq!((first.len(), &first[..2]), (3, &second[..2]));
        assert_ne!(first, second);
    }
}
