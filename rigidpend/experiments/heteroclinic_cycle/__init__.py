"""The heteroclinic cycle of separatrices and pendulum motions: Fig. 2."""
