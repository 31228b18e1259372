//! Names of topics, services and actions in the notation of ROS: relative, private, absolute, and remapped.

use std::fmt;

use crate::error::RosError;

/// A node's name, namespace and remappings.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Naming {
    namespace: String,
    node: String,
    remappings: Vec<Remapping>,
}

/// A remapping, `FROM:=TO`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Remapping {
    /// A name that the node uses; or `__node` (also `__name`) or `__ns`.
    pub from: String,
    /// The replacement of the name.
    pub to: String,
}

impl std::str::FromStr for Remapping {
    type Err = RosError;

    fn from_str(text: &str) -> Result<Self, RosError> {
        match text.split_once(":=") {
            Some((from, to)) if !from.is_empty() && !to.is_empty() => {
                Ok(Self { from: from.to_owned(), to: to.to_owned() })
            }
            _ => Err(RosError::Name { expected: "a remapping FROM:=TO".into(), found: text.into() }),
        }
    }
}

impl fmt::Display for Remapping {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:={}", self.from, self.to)
    }
}

impl Naming {
    /// Creates the naming of a node. `__node` (or `__name`) and `__ns` in the remappings replace its name and its
    /// namespace.
    ///
    /// # Errors
    /// [`RosError::Name`] for an invalid name or remapping.
    pub fn new(namespace: &str, node: &str, remappings: &[Remapping]) -> Result<Self, RosError> {
        let (mut namespace, mut node) = (namespace.to_owned(), node.to_owned());
        let mut names = Vec::new();
        for remapping in remappings {
            match remapping.from.as_str() {
                "__node" | "__name" => node.clone_from(&remapping.to),
                "__ns" => namespace.clone_from(&remapping.to),
                _ => names.push(remapping.clone()),
            }
        }
        check_token(&node, &node)?;
        let mut absolute = String::new();
        for token in namespace.split('/').filter(|token| !token.is_empty()) {
            check_token(token, &namespace)?;
            absolute = format!("{absolute}/{token}");
        }
        let naming = Self { namespace: absolute, node, remappings: names };
        for remapping in &naming.remappings {
            naming.expand(&remapping.from)?;
            naming.expand(&remapping.to)?;
        }
        Ok(naming)
    }

    /// The namespace, starting with a slash; `/` for none.
    pub fn namespace(&self) -> &str {
        if self.namespace.is_empty() { "/" } else { &self.namespace }
    }

    /// The node's name without its namespace.
    pub fn node(&self) -> &str {
        &self.node
    }

    /// The absolute form of a name after remapping; the first matching remapping is used.
    ///
    /// # Errors
    /// [`RosError::Name`] for an invalid name.
    pub fn resolve(&self, name: &str) -> Result<String, RosError> {
        let absolute = self.expand(name)?;
        for Remapping { from, to } in &self.remappings {
            if self.expand(from)? == absolute {
                return self.expand(to);
            }
        }
        Ok(absolute)
    }

    /// The absolute form of a name before remapping.
    fn expand(&self, name: &str) -> Result<String, RosError> {
        let absolute = match name.strip_prefix('~') {
            Some("") => format!("{}/{}", self.namespace, self.node),
            Some(private) if private.starts_with('/') => format!("{}/{}{private}", self.namespace, self.node),
            Some(_) => return Err(refused("a slash after ~", name)),
            None if name.starts_with('/') => name.to_owned(),
            None => format!("{}/{name}", self.namespace),
        };
        // The first token, before the first slash, is empty.
        absolute.split('/').skip(1).try_for_each(|token| check_token(token, name))?;
        Ok(absolute)
    }
}

fn refused(expected: &str, found: &str) -> RosError {
    RosError::Name { expected: expected.to_owned(), found: found.to_owned() }
}

/// Checks a part of a name between slashes.
fn check_token(token: &str, name: &str) -> Result<(), RosError> {
    let mut characters = token.chars();
    let begins = characters.next().is_some_and(|first| first.is_ascii_alphabetic() || first == '_');
    if !begins || !characters.all(|other| other.is_ascii_alphanumeric() || other == '_') {
        return Err(refused("letters, digits and underscores between slashes, no digit first", name));
    }
    if token.contains("__") {
        return Err(refused("no two underscores side by side", name));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn naming(namespace: &str, remappings: &[&str]) -> Naming {
        let remappings: Vec<Remapping> = remappings.iter().map(|text| text.parse().unwrap()).collect();
        Naming::new(namespace, "sdg", &remappings).unwrap()
    }

    #[test]
    fn names_are_relative_private_or_absolute() {
        let in_cell = naming("/cell/left", &[]);
        assert_eq!(in_cell.resolve("image").unwrap(), "/cell/left/image");
        assert_eq!(in_cell.resolve("camera/image").unwrap(), "/cell/left/camera/image");
        assert_eq!(in_cell.resolve("~/grasp_pose").unwrap(), "/cell/left/sdg/grasp_pose");
        assert_eq!(in_cell.resolve("/tf").unwrap(), "/tf");
        assert_eq!(naming("", &[]).resolve("image").unwrap(), "/image");
        assert_eq!((naming("cell", &[]).namespace(), naming("/", &[]).namespace()), ("/cell", "/"));
    }

    #[test]
    fn remappings_are_compared_as_absolute_names() {
        let remapped = naming("/cell", &["image:=/camera/color/image_raw", "~/detections:=found", "__node:=grasper"]);
        assert_eq!(remapped.resolve("image").unwrap(), "/camera/color/image_raw");
        assert_eq!(remapped.resolve("/cell/image").unwrap(), "/camera/color/image_raw");
        assert_eq!(remapped.resolve("~/detections").unwrap(), "/cell/found");
        assert_eq!(remapped.node(), "grasper");
        assert_eq!(naming("", &["__ns:=/a/b"]).namespace(), "/a/b");
    }

    #[test]
    fn what_is_no_name_is_refused() {
        for name in ["", "/", "a//b", "2d", "a/2", "a b", "a__b", "~x", "ä", "a/"] {
            let error = naming("", &[]).resolve(name).unwrap_err().to_string();
            assert!(error.contains(&format!("\"{name}\"")), "{name}: {error}");
        }
        for text in ["image", ":=b", "a:="] {
            assert!(text.parse::<Remapping>().is_err(), "{text}");
        }
        let remapping = ["image:=a b".parse().unwrap()];
        assert!(Naming::new("", "sdg", &remapping).is_err());
        assert!(Naming::new("", "s/dg", &[]).is_err());
    }
}
