//! Levenberg and Marquardt's method, for normal equations of any structure.

/// A problem that [`minimize`] can solve: the sum of squares of a state.
pub trait LeastSquares {
    /// What is looked for.
    type State: Clone;
    /// The normal equations at a state, in the structure that suits the problem.
    type Normal;
    /// A change of state.
    type Step;

    /// The normal equations at `state`; `None` where the state lies outside the problem's domain.
    fn linearize(&self, state: &Self::State) -> Option<Self::Normal>;

    /// The cost that belongs to these normal equations: half the (robust) sum of squares.
    fn cost(&self, normal: &Self::Normal) -> f64;

    /// The step that solves the normal equations with their diagonal multiplied by 1 + `damping`; `None` where they
    /// are singular.
    fn solve(&self, normal: &Self::Normal, damping: f64) -> Option<Solution<Self::Step>>;

    /// `state` moved by `step`.
    fn advance(&self, state: &Self::State, step: &Self::Step) -> Self::State;

    /// These normal equations after a step, as they say themselves: their matrix stays.
    fn follow(&self, normal: &mut Self::Normal, step: &Self::Step);
}

/// A step and what it promises.
#[derive(Clone, Debug)]
pub struct Solution<S> {
    /// The step.
    pub step: S,
    /// By how much the linear model says the cost will fall.
    pub predicted_decrease: f64,
}

/// How hard to try.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effort {
    /// At most so many linearisations.
    pub max_iterations: usize,
    /// Done when the step after the next would make the cost fall by less than this share of it: by what the linear
    /// model promises of the next, times how much smaller promises have become from one step to the next.
    pub cost_tolerance: f64,
}

impl Default for Effort {
    /// 100 iterations, 1e-14: parameters are then good to about 1e-7 of their own standard deviation.
    fn default() -> Self {
        Self { max_iterations: 100, cost_tolerance: 1e-14 }
    }
}

/// Where the minimum was found.
#[derive(Clone, Debug)]
pub struct Minimum<S, N> {
    /// The state.
    pub state: S,
    /// The normal equations there: their matrix to within the last step, which gains a share of 1e4 tolerances of the
    /// cost at most.
    pub normal: N,
    /// Half the (robust) sum of squares.
    pub cost: f64,
    /// Linearisations made.
    pub n_iterations: usize,
    /// False where the iterations ran out first.
    pub converged: bool,
}

/// The last step may gain so many tolerances: it is taken, but what it leads to is not looked at.
const LAST_STEP: f64 = 1e4;

/// A step damped by less is the undamped one for what any camera can know.
const SLIGHT_DAMPING: f64 = 1e-10;

/// The least cost downhill from `start`; `None` where `start` lies outside the problem's domain.
///
/// The damping follows Nielsen (*Damping parameter in Marquardt's method*, IMM-REP-1999-05): after a good step it
/// shrinks by the gain, after a bad one it grows ever faster. The cost never rises.
pub fn minimize<P: LeastSquares>(
    problem: &P,
    start: P::State,
    effort: Effort,
) -> Option<Minimum<P::State, P::Normal>> {
    let mut state = start;
    let mut normal = problem.linearize(&state)?;
    let mut cost = problem.cost(&normal);
    if !cost.is_finite() {
        return None;
    }
    let mut damping = 1e-4;
    let mut growth = 2.0;
    // What the step before promised, where it was taken.
    let mut promised = 0.0;
    let mut n_iterations = 1;
    let mut converged = false;
    while n_iterations < effort.max_iterations {
        let Some(Solution { step, predicted_decrease }) = problem.solve(&normal, damping) else {
            damping = (damping * growth).max(1e-8);
            growth *= 2.0;
            n_iterations += 1;
            if damping > 1e16 {
                break;
            }
            continue;
        };
        let tolerance = effort.cost_tolerance * cost;
        let shrinking = predicted_decrease < promised;
        let left = predicted_decrease * if shrinking { predicted_decrease / promised } else { 1.0 };
        if !(left > tolerance) && !(predicted_decrease > LAST_STEP * tolerance) {
            // Damping makes small promises where little is known: only nearly undamped ones count.
            if damping > SLIGHT_DAMPING {
                damping = SLIGHT_DAMPING;
                n_iterations += 1;
                continue;
            }
            // The last step costs nothing but itself, and leaves its own square as the error.
            if predicted_decrease > 0.0 {
                state = problem.advance(&state, &step);
                problem.follow(&mut normal, &step);
                cost = problem.cost(&normal);
            }
            converged = true;
            break;
        }
        n_iterations += 1;
        let next = problem.advance(&state, &step);
        let accepted = problem.linearize(&next).and_then(|next_normal| {
            let next_cost = problem.cost(&next_normal);
            (next_cost < cost).then_some((next_normal, next_cost))
        });
        match accepted {
            Some((next_normal, next_cost)) => {
                let gain = (cost - next_cost) / predicted_decrease;
                (state, normal, cost) = (next, next_normal, next_cost);
                promised = predicted_decrease;
                damping *= (1.0 - (2.0 * gain - 1.0).powi(3)).clamp(1e-3, 2.0);
                growth = 2.0;
            }
            None => {
                // A promise within the rounding of the sum cannot be told from none.
                if predicted_decrease <= 1e-12 * cost {
                    converged = true;
                    break;
                }
                damping *= growth;
                growth *= 2.0;
                promised = 0.0;
            }
        }
    }
    Some(Minimum { state, normal, cost, n_iterations, converged })
}
