"""Controllers by rule, which optimal control is compared with: schedule, outdoor reset, ASHRAE Guideline 36."""
