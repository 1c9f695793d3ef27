"""The planner: a page in the browser that slides the device along the vessel."""
