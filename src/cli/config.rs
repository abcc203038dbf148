//! Options from a file and from a preset: what the command line leaves open, as if it had been typed.
//!
//! A file's keys are the names of options; what it says yields to the command line, and what a preset
//! says to both. An option that conflicts with one of a higher layer is left out with it: who types
//! `--ratios` does not mean the `levels` of the file.

use std::collections::BTreeSet;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

use clap::parser::ValueSource;
use clap::{Arg, ArgAction, ArgMatches, Args, Command, ValueEnum};
use toml::{Table, Value};

use seamwise::error::{Error, Result};

/// Arguments for options that are kept elsewhere.
#[derive(Debug, Args)]
#[command(next_help_heading = "Input and output")]
pub(crate) struct ConfigArgs {
    /// Options for a purpose.
    ///
    /// Others that are given count for more.
    #[arg(long, value_enum, value_name = "NAME")]
    preset: Option<Preset>,
    /// Read options from a TOML file: its keys are their names, as ratios = [0.5, 0.1].
    ///
    /// Without it, from a seamwise.toml beside the input, or in it where that is a folder. What is typed
    /// counts for more.
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Read no seamwise.toml.
    #[arg(long, conflicts_with = "config")]
    no_config: bool,
}

/// `--preset`.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Preset {
    /// Small downloads for three.js, Babylon.js and model-viewer: textures of each level's own as JPEG,
    /// compressed geometry.
    Web,
    /// Files that game engines import: textures of each level's own, one material where that can be.
    Engine,
    /// Nothing changed but the triangles: textures as they are, as files, with a page of figures.
    Archive,
}

impl Preset {
    fn text(self) -> &'static str {
        match self {
            Self::Web => {
                "textures = 'transfer'\ntexture-format = 'jpeg'\ntexture-quality = 85\ncompress = true"
            }
            Self::Engine => "textures = 'transfer'\nmerge-materials = true",
            Self::Archive => "textures = 'keep'\nformat = 'gltf'\nreport = true",
        }
    }
}

/// The name of the file that is looked for.
const FILE: &str = "seamwise.toml";
/// Options that are typed alone.
const TYPED: [&str; 8] =
    ["config", "dry-run", "help", "manifest", "no-config", "output", "sample", "version"];
/// Options that a file may not have unless it was named, since it may have come with the input from
/// anyone: what reads and writes elsewhere, and what bounds the harm of an input.
const TRUSTED: [&str; 6] =
    ["allow-outside", "allow-unknown", "importance-map", "json", "memory-limit", "threads"];
/// Options that mean nothing without `--textures transfer`: a preset's go where that is not meant.
const OF_TRANSFER: [&str; 3] = ["merge-materials", "texture-format", "texture-quality"];

/// Options, and where they are from.
struct Layer {
    name: String,
    /// Whether the user named it.
    is_trusted: bool,
    options: Table,
}

/// The arguments that a file and a preset add to those of `seamwise bake`, and what they come from.
#[derive(Default)]
pub(super) struct Added {
    /// The arguments, to stand behind the subcommand.
    pub(super) arguments: Vec<OsString>,
    /// The file that was found, not named.
    pub(super) found: Option<PathBuf>,
    /// The names of file and preset, for messages.
    pub(super) names: Vec<String>,
}

/// Reads what is left open.
///
/// # Errors
/// [`Error::Io`] or [`Error::Options`] with the file and the key.
pub(super) fn added(bake: &Command, typed: &ArgMatches) -> Result<Added> {
    let named = typed.get_one::<PathBuf>("config");
    let found = match (named, typed.get_flag("no_config")) {
        (None, false) => find(typed.get_many("inputs").into_iter().flatten())?,
        _ => None,
    };
    let mut layers = Vec::new();
    if let Some(path) = named.or(found.as_ref()) {
        layers.push(Layer::read(path, named.is_some())?);
    }
    let preset = layers.first_mut().and_then(|file| file.options.remove("preset"));
    let preset = match (typed.get_one::<Preset>("preset"), preset) {
        (Some(typed), _) => Some(*typed),
        (None, Some(Value::String(name))) => Some(preset_of(&name, &layers[0].name)?),
        (None, Some(_)) => return Err(wrong(&layers[0].name, "preset", "a name is needed")),
        (None, None) => None,
    };
    layers.extend(preset.map(Layer::preset).transpose()?);
    let mut taken: BTreeSet<String> = bake
        .get_arguments()
        .map(|option| option.get_id().to_string())
        .filter(|id| typed.value_source(id) == Some(ValueSource::CommandLine))
        .collect();
    let mut added = Added { found, ..Added::default() };
    for layer in layers {
        let mut own = BTreeSet::new();
        for (key, value) in &layer.options {
            let option = layer.option(bake, key)?;
            let id = option.get_id().to_string();
            let is_idle = !layer.is_file()
                && taken.contains("textures")
                && OF_TRANSFER.contains(&key.as_str());
            if !is_idle && !taken.contains(&id) && !conflicts(bake, option, &taken) {
                added.arguments.extend(layer.arguments(option, key, value)?);
                own.insert(id);
            }
        }
        taken.extend(own);
        added.names.push(layer.name);
    }
    Ok(added)
}

/// The file beside the inputs, if there is one.
fn find<'a>(inputs: impl Iterator<Item = &'a PathBuf>) -> Result<Option<PathBuf>> {
    let beside = |input: &PathBuf| {
        let folder = if input.is_dir() { Some(input.as_path()) } else { input.parent() };
        folder.map(|folder| folder.join(FILE)).filter(|path| path.is_file())
    };
    let found: BTreeSet<PathBuf> = inputs.filter_map(beside).collect();
    let mut found = found.into_iter();
    match (found.next(), found.next()) {
        (Some(one), Some(other)) => {
            let what = format!(
                "{} and {} both have options: name one with --config, or none with --no-config",
                one.display(),
                other.display()
            );
            Err(Error::Options { what })
        }
        (one, _) => Ok(one),
    }
}

fn preset_of(name: &str, file: &str) -> Result<Preset> {
    Preset::from_str(name, false)
        .map_err(|_| wrong(file, "preset", &format!("{name} is none of web, engine and archive")))
}

fn wrong(layer: &str, key: &str, what: &str) -> Error {
    Error::Options { what: format!("{layer}: {key}: {what}") }
}

/// Whether an option conflicts with one that is taken, by what either says.
fn conflicts(bake: &Command, option: &Arg, taken: &BTreeSet<String>) -> bool {
    let has = |one: &Arg, other: &Arg| {
        bake.get_arg_conflicts_with(one).iter().any(|own| own.get_id() == other.get_id())
    };
    let taken = bake.get_arguments().filter(|own| taken.contains(own.get_id().as_str()));
    taken.into_iter().any(|own| has(option, own) || has(own, option))
}

impl Layer {
    fn read(path: &Path, is_trusted: bool) -> Result<Self> {
        let name = path.display().to_string();
        let text = std::fs::read_to_string(path)
            .map_err(|source| Error::Io { path: path.into(), source })?;
        Self::parse(name, &text, is_trusted)
    }

    fn preset(preset: Preset) -> Result<Self> {
        let name = preset.to_possible_value().map_or_else(String::new, |own| own.get_name().into());
        Self::parse(format!("--preset {name}"), preset.text(), true)
    }

    fn parse(name: String, text: &str, is_trusted: bool) -> Result<Self> {
        match text.parse::<Table>() {
            Ok(options) => Ok(Self { name, is_trusted, options }),
            Err(error) => {
                let at = error.span().map_or(0, |span| span.start);
                let line = text[..at].matches('\n').count() + 1;
                Err(wrong(&name, &format!("line {line}"), error.message()))
            }
        }
    }

    fn is_file(&self) -> bool {
        !self.name.starts_with("--preset")
    }

    /// The option that a key names.
    fn option<'a>(&self, bake: &'a Command, key: &str) -> Result<&'a Arg> {
        let refused = |what: &str| Err(wrong(&self.name, key, what));
        let is_named = |option: &&Arg, key: &str| {
            let others = option.get_all_aliases().unwrap_or_default();
            option.get_long() == Some(key) || others.contains(&key)
        };
        let Some(option) = bake.get_arguments().find(|option| is_named(option, key)) else {
            let dashed = key.replace('_', "-");
            if bake.get_arguments().any(|option| is_named(&option, &dashed)) {
                return refused(&format!("there is no such option: did you mean {dashed}?"));
            }
            return refused("there is no such option; `seamwise bake --help` has all");
        };
        if TYPED.contains(&key) {
            return refused("this is for the command line");
        }
        if !self.is_trusted && TRUSTED.contains(&key) {
            return refused(
                "a file that came with the input may not say this: name it with --config",
            );
        }
        Ok(option)
    }

    /// An option and its value as they would be typed.
    fn arguments(&self, option: &Arg, key: &str, value: &Value) -> Result<Vec<OsString>> {
        let refused = |what: &str| Err(wrong(&self.name, key, what));
        let is_flag = matches!(option.get_action(), ArgAction::SetTrue)
            || option.get_num_args().is_some_and(|count| count.min_values() == 0);
        let with = |value: &str| OsString::from(format!("--{key}={value}"));
        let texts = match value {
            Value::Boolean(true) if is_flag => return Ok(vec![format!("--{key}").into()]),
            Value::Boolean(false) if is_flag => return Ok(Vec::new()),
            Value::Boolean(_) => return refused("a value is needed, not true or false"),
            _ if matches!(option.get_action(), ArgAction::SetTrue) => {
                return refused("true or false is needed");
            }
            _ if key == "report" && !self.is_trusted => {
                return refused("a file that came with the input may say true or false alone");
            }
            Value::Array(list) => list.iter().map(text_of).collect::<Option<Vec<String>>>(),
            other => text_of(other).map(|text| vec![text]),
        };
        let is_list = matches!(value, Value::Array(_));
        match (texts, option.get_value_delimiter(), option.get_action()) {
            (Some(texts), _, ArgAction::Append) => {
                Ok(texts.iter().map(|text| with(text)).collect())
            }
            (Some(texts), Some(comma), _) => Ok(vec![with(&texts.join(&comma.to_string()))]),
            (Some(texts), None, _) if !is_list => Ok(vec![with(&texts[0])]),
            _ => refused("one number or text is needed"),
        }
    }
}

fn text_of(value: &Value) -> Option<String> {
    match value {
        Value::String(text) => Some(text.clone()),
        Value::Integer(number) => Some(number.to_string()),
        Value::Float(number) => Some(number.to_string()),
        _ => None,
    }
}
