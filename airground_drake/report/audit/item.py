"""The form of a finding about the paper."""

from collections.abc import Mapping
from typing import Any

from airground_drake.verify import Finding

Item = dict[str, Any]

# Findings, by number, that a fault in our text conversion of the paper could explain, and how.
CONVERSION = {
    6: "The table's '1t' may have lost something.",
    7: "A minus sign is easily lost.",
    8: "rho and sigma, {0, 1} and [0, 1], (b) and (c) are easily mistaken for each other.",
    12: "The subscripts m and md, j and d are easily mistaken for each other.",
    22: "Some of the indices may have been other letters: n and N, j and r.",
}


def item(
    number: int, where: str, finding: str, paper: Any, ours: Any, shown: bool, evidence: Item, unit: str = ""
) -> Item:
    """Item `number`, about the place `where` of the paper, with its `evidence` and formulas."""
    in_the_paper, corrected = FORMULAS.get(number, ((), ()))
    return {
        "id": number,
        "where": where,
        "finding": finding,
        "paper": paper,
        "ours": ours,
        "unit": unit,
        "demonstrated": bool(shown),
        "evidence": evidence,
        "latex": {"paper": list(in_the_paper), "ours": list(corrected)},
        "conversion": CONVERSION.get(number, ""),
    }


def status(proofs: Mapping[str, Finding], claim: str) -> str:
    return proofs[claim].status if claim in proofs else "not_run"


# By number of the finding; findings about numbers alone are left out.
FORMULAS: dict[int, tuple[tuple[str, ...], tuple[str, ...]]] = {
    1: (
        (r"v = v_1 + (I - J_1^+ J_1) (v_2 + (I - J_2^+ J_2) v_3)",),
        (
            r"v = v_1 + (I - J_1^+ J_1) v_2 + (I - J_{12}^+ J_{12}) v_3",
            r"J_{12} = \begin{bmatrix} J_1 \\ J_2 \end{bmatrix} \quad \text{(all higher tasks, stacked)}",
        ),
    ),
    2: (
        (r"\frac{\sigma^2}{\mu^2} (\sinh u + u) = \frac{c_1}{c_2}, \quad u = \frac{2 \zeta \mu}{\sigma^2}",),
        (r"\frac{\sigma^2}{\mu^2} (\sinh u + u) = \frac{c_2}{c_1}, \quad u = \frac{2 \zeta \mu}{\sigma^2}",),
    ),
    3: (
        (
            r"T = \frac{\zeta}{\mu} \tanh \frac{\zeta \mu}{\sigma^2} + \frac{2 \zeta}{\mu} \,"
            r"\frac{1 - e^{-2 y_0 \mu^2 / \sigma^2}}{2 \sinh (2 \zeta \mu / \sigma^2)} - y_0",
            r"y_0 \text{ in seconds}",
        ),
        (
            r"T = \frac{\zeta}{\mu} \tanh \frac{\zeta \mu}{\sigma^2} + \frac{2 \zeta}{\mu} \,"
            r"\frac{1 - e^{-2 y_0 \mu / \sigma^2}}{2 \sinh (2 \zeta \mu / \sigma^2)} - \frac{y_0}{\mu}",
            r"y_0 \text{ in metres}",
        ),
    ),
    4: (
        (r"\zeta = 3 \text{ m solves (19) for two drifts } \mu \text{ only}",),
        (r"\operatorname{argmin}_\zeta B(\zeta; \mu) = 3 \text{ m for two other drifts } \mu \text{ only}",),
    ),
    5: (
        (r"dx = \mu \, dt + \sigma_j \, dW, \quad \sigma_j = 10",),
        (
            r"t_{1/2} = \frac{\zeta^2}{(\Phi^{-1}(3/4))^2 \, \sigma_j^2} \quad \text{(median, one threshold)}",
            r"\mathbb{E}[\min\{t : |\sigma_j W(t)| \ge \zeta\}] = \frac{\zeta^2}{\sigma_j^2}",
        ),
    ),
    7: ((r"\rho_{rd,2} = [1.3, \; t, \; 0]",), (r"\rho_{rd,2} = [-1.3, \; t, \; 0]",)),
    8: (
        (
            r"v = J^+ \dot\rho_d, \quad (3 \times 1) (3 \times 1) \text{ is not defined}",
            r"v = J^+ (\dot\rho_d + \Lambda (\rho_d - \rho))",
        ),
        (
            r"v = J^+ \dot\sigma_d, \quad (3 \times 1) (1 \times 1) = 3 \times 1",
            r"v = J^+ (\dot\sigma_d + \Lambda (\sigma_d - \sigma))",
        ),
    ),
    9: (
        (r"\text{trigger whenever } x(t) \ge \zeta",),
        (
            r"\text{trigger if } x(t) \ge \zeta \text{ and } t - t_k \ge \tau_{\min}",
            r"\text{release at } x(t) \le \zeta_r < \zeta",
        ),
    ),
    10: (
        (r"\lVert \rho - o_j \rVert \ge d - u, \quad u \ge 0, \quad \min J + b \int u^2 \, dt",),
        (r"n_j^\top v \ge -\frac{D_j - d}{h} \quad \text{for every } j, \text{ below which nothing is executed}",),
    ),
    11: (
        (r"\min_{\rho, \omega} J(\rho) \quad \text{subject to (26b)-(26e)}",),
        (r"\min_{\rho, \omega} J(\rho) \quad \text{subject to (26b)-(26e) and } \dot\rho = \omega a + (1 - \omega) b",),
    ),
    12: (
        (r"v = J^+ (\dot\sigma_m + B (\sigma_{md} - \sigma_m))",),
        (r"v = J^+ (\dot\sigma_{md} + B (\sigma_{md} - \sigma_m))",),
    ),
    13: (
        (r"\sigma = \frac{1}{n} \sum_j \rho_j", r"\frac{\partial \sigma}{\partial \rho_{\text{UAV}}} = 0"),
        (
            r"\sigma = \rho_{\text{UAV}} - \frac{1}{n} \sum_j \rho_j",
            r"\frac{\partial \sigma}{\partial \rho_{\text{UAV}}} = I",
        ),
    ),
    14: (
        (r"J = \sum_{k=0}^{N} \ell(\rho_k)",),
        (r"J = \Delta t \sum_{k=1}^{N} \ell(\rho_k) \approx \int_0^T \ell(\rho) \, dt",),
    ),
    15: (
        (r"m_r > n - \sum_{i < r} m_i \quad \text{so that} \quad n > \sum_i m_i",),
        (r"m_r > n - \sum_{i < r} m_i \; \Leftrightarrow \; n < \sum_i m_i",),
    ),
    16: (
        (r"v = v_{int} + (I - J_{int}^+ J_{int}) v_{\text{own}}, \quad J_{int} = I \; \Rightarrow \; v = v_{int}",),
        (r"v = \operatorname{avoid}(v_{int} + (I - J_{int}^+ J_{int}) v_{\text{own}}) \quad \text{(method (d))}",),
    ),
    18: (
        (r"T = \frac{\zeta}{\mu} \tanh \frac{\zeta \mu}{\sigma^2}", r"E = \frac{1}{1 + e^{2 \zeta \mu / \sigma^2}}"),
        (r"T = \frac{\zeta}{\mu} \quad \text{(one threshold, } \mu > 0 \text{)}", r"E = 0"),
    ),
    19: (
        (r"v_{int} = J^+ (J v_{int} + \Lambda (\sigma_{int} - \sigma_{in}))",),
        (r"v_{int} = J^+ (\dot\sigma_d + \Lambda (\sigma_d - \sigma))",),
    ),
}
