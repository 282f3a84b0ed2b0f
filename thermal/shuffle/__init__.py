"""The paper's randomized shuffling of air within zones, and the two terms of the model that equal its mean."""
