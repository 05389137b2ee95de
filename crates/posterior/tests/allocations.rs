//! A solve takes no memory.

mod fixtures;

use fixtures::Problem;
use posterior::{MapSolver, SolverParameters};

#[test]
fn a_solve_takes_no_memory() {
    let mut problem = Problem::walk(6, 5, 0);
    let mut solver = MapSolver::new(6, problem.dofs());
    let mut likelihood = problem.likelihood();
    let mut sigmas = vec![0.0; problem.dofs()];
    let residuals = vec![0.01; 64 * problem.dofs()];
    let min_sigma = vec![0.01; problem.dofs()];
    let counted = allocation_counter::measure(|| {
        problem.prior.set_full(&residuals, &min_sigma);
        let parameters = SolverParameters::default();
        let (kinematics, measured, prior) = (&problem.kinematics, &problem.measured, &problem.prior);
        solver.solve(kinematics, &mut likelihood, measured, prior, &parameters);
        solver.standard_deviations(kinematics, &mut likelihood, measured, prior, &mut sigmas);
        problem.prior.set_diagonal(&residuals, &min_sigma);
    });
    assert_eq!(counted.count_total, 0, "{counted:?}");
    assert!(sigmas.iter().all(|s| *s > 0.0));
}
