namespace reliefbench {}
