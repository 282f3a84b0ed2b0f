"""Generated cases of the size of the paper's pilot building, and twins of any, from a seed."""
