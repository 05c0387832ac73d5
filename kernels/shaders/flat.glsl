// No relief: the plane itself. The floor of frame time.
Hit trace(Ray ray) { return Hit(0.0, STATUS_HIT, 0, 0); }
