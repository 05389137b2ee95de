//! The solver against dense algebra on the same energy.

mod fixtures;

use fixtures::Problem;
use nalgebra::{DMatrix, DVector};
use posterior::{MapSolver, Solution, SolverParameters};

const TO_THE_END: SolverParameters = SolverParameters { max_steps: 100, relative_decrease: 0.0 };

fn solve(problem: &Problem, parameters: &SolverParameters) -> (Solution, MapSolver) {
    let mut solver = MapSolver::new(problem.points.len(), problem.dofs());
    let mut likelihood = problem.likelihood();
    let solution =
        solver.solve(&problem.kinematics, &mut likelihood, &problem.measured, &problem.prior, parameters);
    (solution, solver)
}

fn deviations(problem: &Problem, solver: &mut MapSolver) -> Vec<f64> {
    let mut out = vec![0.0; problem.dofs()];
    let mut likelihood = problem.likelihood();
    solver.standard_deviations(
        &problem.kinematics,
        &mut likelihood,
        &problem.measured,
        &problem.prior,
        &mut out,
    );
    out
}

/// Problems with 2 to 6 points, some of them not measured.
fn problems() -> Vec<Problem> {
    let mut all = Vec::new();
    for (seed, (points, later)) in [(6, 1), (6, 8), (4, 4), (2, 12), (6, 20)].into_iter().enumerate() {
        all.push(Problem::walk(points, later, seed as u64));
        let mut gaps = Problem::walk(points, later, seed as u64);
        gaps.measured[0] = None;
        if points == 6 {
            gaps.measured[4] = None;
            gaps.measured[3] = None;
        }
        all.push(gaps);
    }
    all
}

#[test]
fn the_solver_finds_the_minimum_that_dense_algebra_finds() {
    for (i, problem) in problems().iter().enumerate() {
        let (solution, solver) = solve(problem, &TO_THE_END);
        let expected = problem.dense_minimum();
        for (d, (found, expected)) in solver.coordinates().iter().zip(expected.iter()).enumerate() {
            assert!((found - expected).abs() < 1e-5, "problem {i}, coordinate {d}: {found}, not {expected}");
        }
        let (likelihood, prior) = problem.energies(&expected, &problem.precision());
        assert!((solution.likelihood_energy - likelihood).abs() < 1e-6 * (1.0 + likelihood), "problem {i}");
        assert!((solution.prior_energy - prior).abs() < 1e-6 * (1.0 + prior), "problem {i}");
    }
}

#[test]
fn the_gradient_is_zero_where_the_solver_ends() {
    for (i, problem) in problems().iter().enumerate() {
        let (solution, mut solver) = solve(problem, &TO_THE_END);
        let x = DVector::from_column_slice(solver.coordinates());
        let precision = problem.precision();
        let energy = |x: &DVector<f64>| {
            let (a, b) = problem.energies(x, &precision);
            a + b
        };
        let scale = solution.likelihood_energy + solution.prior_energy;
        for (d, sigma) in deviations(problem, &mut solver).into_iter().enumerate() {
            // A step of the posterior's own size.
            let mut step = DVector::zeros(problem.dofs());
            step[d] = 1e-3 * sigma;
            let slope = (energy(&(&x + &step)) - energy(&(&x - &step))) / 2e-3;
            assert!(
                slope.abs() < 1e-3 * (1.0 + scale),
                "problem {i}, coordinate {d}: slope {slope} of {scale}"
            );
        }
    }
}

#[test]
fn the_default_steps_come_close_to_the_minimum() {
    for (i, problem) in problems().iter().enumerate() {
        let (exact, _) = solve(problem, &TO_THE_END);
        let (default, _) = solve(problem, &SolverParameters::default());
        let energy = |s: &Solution| s.likelihood_energy + s.prior_energy;
        assert!(energy(&default) <= 1.001 * energy(&exact) + 1e-6, "problem {i}: {default:?}, {exact:?}");
    }
}

#[test]
fn more_steps_never_raise_the_energy() {
    for (i, problem) in problems().iter().enumerate() {
        let mean = DVector::from_column_slice(&problem.prior.mean);
        let mut last = problem.energies(&mean, &problem.precision()).0;
        for max_steps in 1..15 {
            let (solution, _) = solve(problem, &SolverParameters { max_steps, ..TO_THE_END });
            let energy = solution.likelihood_energy + solution.prior_energy;
            assert!(energy <= last * (1.0 + 1e-12), "problem {i}, {max_steps} steps: {energy} after {last}");
            assert!(solution.steps <= max_steps);
            last = energy;
        }
    }
}

#[test]
fn with_nothing_measured_the_prior_is_the_answer() {
    let mut problem = Problem::walk(6, 3, 1);
    problem.measured.fill(None);
    let (solution, mut solver) = solve(&problem, &SolverParameters::default());
    assert_eq!(solver.coordinates(), problem.prior.mean);
    let zero = Solution {
        steps: 0,
        likelihood_energy: 0.0,
        prior_energy: 0.0,
        residual_m: 0.0,
        log_determinant: 0.0,
    };
    assert_eq!(solution, zero);
    for (d, sigma) in deviations(&problem, &mut solver).into_iter().enumerate() {
        let variance = problem.prior.covariance[d * problem.dofs() + d];
        assert!((sigma * sigma - variance).abs() < 1e-15);
    }
}

/// `(Σ⁻¹ + JᵀWJ)⁻¹` at the solution, J by differences.
fn dense_posterior(problem: &Problem, solver: &MapSolver) -> DMatrix<f64> {
    let j = problem.weighted_jacobian(&DVector::from_column_slice(solver.coordinates()));
    (problem.precision() + j.transpose() * j).try_inverse().unwrap()
}

#[test]
fn standard_deviations_are_those_of_the_inverse_hessian() {
    for (i, problem) in problems().iter().enumerate() {
        let (_, mut solver) = solve(problem, &TO_THE_END);
        let expected = dense_posterior(problem, &solver);
        for (d, sigma) in deviations(problem, &mut solver).into_iter().enumerate() {
            let expected = expected[(d, d)].sqrt();
            assert!(
                (sigma - expected).abs() < 1e-6 * expected,
                "problem {i}, coordinate {d}: {sigma}, {expected}"
            );
            assert!(sigma * sigma <= problem.prior.covariance[d * problem.dofs() + d] * (1.0 + 1e-12));
        }
    }
}

/// Where points are linear in the coordinates everything is known in closed form.
#[test]
fn the_linear_case_is_exact() {
    for seed in 0..20 {
        let mut problem = Problem::linear(seed);
        if seed % 3 == 0 {
            problem.measured[1] = None;
        }
        let (solution, mut solver) = solve(&problem, &SolverParameters::default());
        let mean = DVector::from_column_slice(&problem.prior.mean);
        let j = problem.weighted_jacobian(&mean);
        let r = problem.weighted_residuals(&mean);
        let covariance = dense_posterior(&problem, &solver);
        let expected = &mean - &covariance * j.transpose() * &r;
        for (found, expected) in solver.coordinates().iter().zip(expected.iter()) {
            assert!((found - expected).abs() < 1e-9, "seed {seed}");
        }
        for (d, sigma) in deviations(&problem, &mut solver).into_iter().enumerate() {
            assert!((sigma - covariance[(d, d)].sqrt()).abs() < 1e-9, "seed {seed}");
        }
        // The measurements' own density: c ~ N(f(μ), JΣJᵀ + W⁻¹).
        let spread = &j * problem.covariance() * j.transpose() + DMatrix::identity(r.len(), r.len());
        let sigma: f64 = 0.05;
        let log_determinant = spread.determinant().ln() + 2.0 * r.len() as f64 * sigma.ln();
        let mahalanobis = (r.transpose() * spread.try_inverse().unwrap() * &r)[0];
        let expected = 0.5 * (mahalanobis + log_determinant);
        assert!((solution.surprise() - expected).abs() < 1e-6 * (1.0 + expected.abs()), "seed {seed}");
        assert!(solution.residual_m > 0.0);
    }
}

#[test]
fn measurements_out_of_reach_are_approached_and_survived() {
    for distance in [3.0, 1e3, 1e6] {
        let mut problem = Problem::walk(6, 1, 2);
        if let Some(m) = &mut problem.measured[0] {
            m.position.x += distance;
        }
        let (solution, mut solver) = solve(&problem, &SolverParameters::default());
        assert!(solver.coordinates().iter().all(|v| v.is_finite()), "{distance} m away");
        assert!(solution.likelihood_energy.is_finite() && solution.prior_energy.is_finite());
        let mean = DVector::from_column_slice(&problem.prior.mean);
        let before = problem.energies(&mean, &problem.precision()).0;
        assert!(solution.likelihood_energy + solution.prior_energy <= before);
        assert!(deviations(&problem, &mut solver).iter().all(|s| s.is_finite()));
    }
}
