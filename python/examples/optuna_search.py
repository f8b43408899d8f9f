"""`vibrissa.strain` as the objective of an Optuna study: which taper, gauge and tap angle tell distance with the least noise and bias?

    python optuna_search.py
"""

import numpy as np
import optuna

import vibrissa

A = np.arange(21.0, 49.0, 3.0)
NOISE = 20e-6
LIMIT = 0.05


def objective(trial):
    """Root mean square error of the distance: bias of the linear inversion with one K, and noise of the gauge; mm."""
    d = trial.suggest_float("d", 3, 10)
    x_ss = trial.suggest_float("x_ss", 3, 15)
    theta = trial.suggest_float("theta", 0.5, 10)
    result = vibrissa.sweep(whisker=dict(D=10, d=d, L_a=50), gauge=dict(x_ss=x_ss, l=2, noise_strain=NOISE), tap=dict(a=A, theta=theta), run=dict(backend="cpu"))
    strain = vibrissa.strain(10.0, d, 50.0, x_ss, 2.0, A, theta)
    if not np.abs(strain).max() <= LIMIT:
        raise optuna.TrialPruned
    assert result.designs is not None
    total = result.designs["total_rms_mm"][0]
    return float(total) if np.isfinite(total) else 1e3


def main(trials=150):
    optuna.logging.set_verbosity(optuna.logging.WARNING)
    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=1))
    study.optimize(objective, n_trials=trials)
    own = vibrissa.optimise(whisker=dict(D=10, L_a=50), gauge=dict(l=2, noise_strain=NOISE), tap=dict(a=A), run=dict(backend="cpu"), optimise=dict(
        objective="distance", variables=dict(d=[3, 10], x_ss=[3, 15], theta=[0.5, 10]), limits=dict(strain=LIMIT)))
    print(f"Optuna, {trials} trials: {study.best_params}: total_rms_mm = {study.best_value:.4e}")
    print(f"vibrissa, {own.run['counts']['evaluations']} evaluations: {({k: own.best[k] for k in ('d_tip_mm', 'x_ss_mm', 'theta_deg')})}: total_rms_mm = {own.value:.4e}")
    return study.best_value, own.value


if __name__ == "__main__":
    main()
