"""Operation of a real building: historian, collector, controller, guard and page, each a process of its own."""
