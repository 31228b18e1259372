//! A module's parameters by name, on the host: the content of a file or of an import.
//!
//! A name is the module path joined with dots, as Detectron2 and torch write it, so renaming is a map from strings
//! to strings.

use std::collections::BTreeMap;

use burn::module::{Module, ModuleMapper, ModuleVisitor, Param};
use burn::tensor::{Tensor, TensorData};

/// One parameter: its shape and its values, row-major.
#[derive(Debug, Clone, PartialEq)]
pub struct WeightTensor {
    /// Sizes, outermost first.
    pub shape: Vec<usize>,
    /// Values, as many as the shape requires.
    pub values: Vec<f32>,
}

/// Parameters by name, in the order of their names.
pub type StateDict = BTreeMap<String, WeightTensor>;

/// The result of an import for every name.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ImportReport {
    /// Parameters that were set.
    pub applied: Vec<String>,
    /// Parameters of the module that the dict lacks; they kept their values.
    pub missing: Vec<String>,
    /// Entries of the dict that no parameter used.
    pub unused: Vec<String>,
    /// Parameters of another shape, with the expected and the found shape; they kept their values.
    pub mismatched: Vec<(String, Vec<usize>, Vec<usize>)>,
}

impl ImportReport {
    /// Whether every parameter was set and every entry used.
    pub fn is_complete(&self) -> bool {
        self.missing.is_empty() && self.unused.is_empty() && self.mismatched.is_empty()
    }
}

/// Copies every float parameter of `module` to the host.
pub fn export<M: Module>(module: &M) -> StateDict {
    let mut exporter = Exporter { path: Vec::new(), dict: StateDict::new() };
    module.visit(&mut exporter);
    exporter.dict
}

/// Sets every float parameter of `module` for which `dict` has an entry of the correct shape, and reports the rest.
pub fn import<M: Module>(module: M, dict: &StateDict) -> (M, ImportReport) {
    let mut importer = Importer { path: Vec::new(), dict, report: ImportReport::default() };
    let module = module.map(&mut importer);
    let mut report = importer.report;
    let taken = |name: &String| {
        report.applied.contains(name) || report.mismatched.iter().any(|(mismatched, ..)| mismatched == name)
    };
    report.unused = dict.keys().filter(|name| !taken(name)).cloned().collect();
    (module, report)
}

struct Exporter {
    path: Vec<String>,
    dict: StateDict,
}

impl ModuleVisitor for Exporter {
    fn enter_module(&mut self, name: &str, _container_type: &str) {
        self.path.push(name.to_owned());
    }

    fn exit_module(&mut self, _name: &str, _container_type: &str) {
        self.path.pop();
    }

    fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
        let tensor = param.val();
        let shape = tensor.dims().to_vec();
        let values = tensor.into_data().iter::<f32>().collect();
        self.dict.insert(self.path.join("."), WeightTensor { shape, values });
    }
}

struct Importer<'a> {
    path: Vec<String>,
    dict: &'a StateDict,
    report: ImportReport,
}

impl ModuleMapper for Importer<'_> {
    fn enter_module(&mut self, name: &str, _container_type: &str) {
        self.path.push(name.to_owned());
    }

    fn exit_module(&mut self, _name: &str, _container_type: &str) {
        self.path.pop();
    }

    fn map_float<const D: usize>(&mut self, param: Param<Tensor<D>>) -> Param<Tensor<D>> {
        let name = self.path.join(".");
        let Some(found) = self.dict.get(&name) else {
            self.report.missing.push(name);
            return param;
        };
        let expected = param.lazy_shape().to_vec();
        if expected != found.shape {
            self.report.mismatched.push((name, expected, found.shape.clone()));
            return param;
        }
        self.report.applied.push(name);
        let data = TensorData::new(found.values.clone(), found.shape.clone());
        param.map(|tensor| {
            let trains = tensor.is_require_grad();
            Tensor::from_data(data, &tensor.device()).set_require_grad(trains)
        })
    }
}
