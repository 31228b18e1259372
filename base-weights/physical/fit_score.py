"""Fits the score's terms of the close look, on candidates with ground truth. Usage: fit_score.py RECORDS.jsonl ...

`sdg evaluate --split FILE --sets DIR --tuned --records RECORDS.jsonl` writes the records. A logistic regression combines
the sum of the bounded terms with the five terms of the close look; each set has the same weight, and so have its
right and its wrong poses. For the printed counts each set is judged by a fit on the other sets; the last line is the
fit on all sets. Look-alikes other than mirror images are judged but not used for fitting.

Needs numpy and scikit-learn.
"""

import json
import sys

import numpy as np
from sklearn.linear_model import LogisticRegression

CLOSE = ["table", "rim", "added", "mirror", "details"]


def read(paths):
    """For each candidate: its set, whether it is right, its kind, and the values of the regression."""
    for path in paths:
        with open(path) as lines:
            for record in map(json.loads, lines):
                if record["place"] == "misplaced" or record["hit"] == "optional":
                    continue
                evidence = record["evidence"]
                bounded = sum(value for name, value in evidence.items() if name not in CLOSE)
                values = [bounded] + [evidence[name] for name in CLOSE]
                yield record["set"], record["place"] == "right", record["kind"], values


def fit(values, is_right, sets):
    """Factors of the values, and the bias."""
    weights = np.zeros(len(is_right))
    for name in set(sets):
        for side in (False, True):
            chosen = (sets == name) & (is_right == side)
            weights[chosen] = 50.0 / max(1, chosen.sum())
    mean, spread = values.mean(0), values.std(0) + 1e-9
    model = LogisticRegression(C=1.0, max_iter=5000)
    model.fit((values - mean) / spread, is_right, sample_weight=weights)
    factors = model.coef_[0] / spread
    return factors, model.intercept_[0] - (factors * mean).sum()


def main():
    sets, is_right, kinds, values = map(np.array, zip(*read(sys.argv[1:])))
    is_look_alike = kinds == "neg_look"
    log_odds = np.zeros(len(sets))
    for name in np.unique(sets):
        others = (sets != name) & ~is_look_alike
        factors, bias = fit(values[others], is_right[others], sets[others])
        log_odds[sets == name] = values[sets == name] @ factors + bias
    is_mirror = kinds == "neg_mirror"
    for limit in (0.0, 0.5, 1.0):
        accepted = log_odds > limit
        others = ~is_right & ~is_look_alike & ~is_mirror
        print(
            f"limit {limit}: right refused {(is_right & ~accepted).sum()} of {is_right.sum()}, "
            f"wrong accepted {(others & accepted).sum()} of {others.sum()}, "
            f"mirror images {(is_mirror & accepted).sum()} of {is_mirror.sum()}, "
            f"other look-alikes {(is_look_alike & accepted).sum()} of {is_look_alike.sum()}"
        )
    factors, bias = fit(values[~is_look_alike], is_right[~is_look_alike], sets[~is_look_alike])
    named = ", ".join(f"{name} {factor:.2f}" for name, factor in zip(["bounded"] + CLOSE, factors))
    print(f"factors of today's terms: {named}; bias {bias:+.2f}")


if __name__ == "__main__":
    main()
