// No relief: the polygon itself. The floor of frame time.
Hit trace(Ray ray) { return Hit(polygon_t(), STATUS_HIT, 0, 0); }
