use regression::gplvm::GplvmPredictor;
use regression::{LocalPca, LocalRegression, NearestExample, Predictor, PrincipalRegression};

use crate::problem::Problem;
use crate::{Error, Method, Result};

/// The predictor of the run's method, for examples of `width` inputs.
///
/// # Errors
/// [`Error::NoModel`] if the method needs a model and there is none.
pub fn predictor<'a>(problem: &'a Problem<'_>, width: usize) -> Result<Box<dyn Predictor + 'a>> {
    let parameters = problem.parameters;
    let (k, dofs) = (parameters.neighbours, problem.database.num_dofs());
    Ok(match parameters.method {
        Method::LocalRegression => Box::new(LocalRegression::new(k, dofs)),
        Method::Nearest => Box::new(NearestExample),
        Method::Lpca => Box::new(LocalPca::new(k, dofs, parameters.lpca())),
        Method::Lpcr => Box::new(PrincipalRegression::new(k, width, dofs, parameters.lpcr())),
        Method::Gplvm => {
            let model = problem.model.ok_or(Error::NoModel)?;
            Box::new(GplvmPredictor::new(model, parameters.gplvm()))
        }
    })
}
