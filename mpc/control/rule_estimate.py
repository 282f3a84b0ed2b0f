"""What a plan and the rule cost from the same state by the same model: the comparison that a saving is told by."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class RuleEstimate:
    """Cost of a plan and of the rule over the same horizon.

    Parameters
    ----------
    plan, rule : float
        Bought over the horizon [currency].
    stored : float
        Heat that the plan leaves in the building beyond what the rule leaves, at what the rule's heat costs [currency];
        negative where the plan ends colder.
    """

    plan: float
    rule: float
    stored: float

    @property
    def saving(self) -> float:
        """Share of the rule's cost that the plan saves, what it leaves in the building included [-]; 0 without cost."""
        return (self.rule - self.plan + self.stored) / self.rule if self.rule > 0.0 else 0.0
