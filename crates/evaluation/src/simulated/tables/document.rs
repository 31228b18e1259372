//! Common sections of all documents and pages: whether they are complete, and how to reproduce the results.

use sdg_report::Section;

use super::titled::Titled;

/// A notice that precedes the tables, if units of work remain.
pub fn incomplete(remaining: usize) -> Option<String> {
    (remaining > 0)
        .then(|| format!("Not complete: {remaining} units of work are left. Run the same command again to continue."))
}

/// Tables as a document in Markdown; `facts` and `command` are for reproducing the results.
pub fn document(
    title: &str,
    notice: Option<String>,
    tables: impl IntoIterator<Item = Titled>,
    facts: &[(&str, String)],
    command: &str,
) -> String {
    let mut text = format!("# {title}\n\n");
    if let Some(notice) = notice {
        text += &format!("**{notice}**\n\n");
    }
    for Titled { title, lead, table } in tables {
        text += &format!("## {title}\n\n{lead}\n\n{}\n", table.to_markdown());
    }
    text += "## This run\n\n";
    for (name, value) in facts {
        text += &format!("- {name}: {value}\n");
    }
    text + &format!("\n```\n{command}\n```\n")
}

/// The settings and the command as a section at the end of a page.
pub fn this_run(facts: &[(&str, String)], command: &str) -> Section {
    Section::new("This run")
        .lead("Settings for reproducing the numbers.")
        .facts(facts.iter().map(|(name, value)| (*name, value.clone())))
        .command(command)
}
