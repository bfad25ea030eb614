"""How sigma fares that is the larger of a classical and a clustered one, against one shrunk towards the classical.

    python larger_of_two.py          # numpy

The clustered variance scatters as chi squared over its degrees of freedom (about the number of pictures); the truth is
the classical one times how alike residuals of one picture make it. Prints, for each rule, the mean of the estimated
sigma over the true one, and how many of the intervals of 95 % hold the truth.
"""

import numpy as np

RUNS = 20000


def larger(ratio, _):
    return np.maximum(ratio, 1)


def shrunk(ratio, degrees):
    """The excess counts as far as it stands out of its own scatter."""
    excess = np.maximum(ratio - 1, 0)
    return 1 + excess**3 / (excess**2 + 2 / degrees)


def posterior(ratio, degrees):
    """The mean variance if one is as likely as more, and more as the logarithm's Cauchy distribution says."""
    beyond = np.linspace(0, 8, 321)
    prior = 1 / (1 + beyond**2)
    prior[0] = prior[1:].sum()
    likelihood = -0.5 * degrees * (beyond + ratio[:, None] * np.exp(-beyond))
    share = prior * np.exp(likelihood - likelihood.max(1, keepdims=True))
    return share @ np.exp(beyond) / share.sum(1)


def main():
    random = np.random.default_rng(1)
    rules = [larger, shrunk, posterior]
    print("pictures  truth over classical  " + "  ".join(f"{rule.__name__:>14}" for rule in rules))
    for degrees in (10, 15, 25):
        for true in (1, 1.25, 1.5, 2, 4):
            ratio = true * random.chisquare(degrees, RUNS) / degrees
            error = random.standard_normal(RUNS) * np.sqrt(true)
            words = []
            for rule in rules:
                sigma = np.sqrt(rule(ratio, degrees))
                held = 100 * np.mean(abs(error) < 1.96 * sigma)
                words.append(f"{np.mean(sigma) / np.sqrt(true):5.2f}, {held:5.1f} %")
            print(f"{degrees:8}  {true:20.2f}  " + "  ".join(f"{word:>14}" for word in words))


main()
