"""What several tests share: a small scope, and the rates of the tables."""

from sagnac.paper.prediction import Scope

SMALL = Scope(table_duration_s=40.0, figure_duration_s=396.0, days=1)
RATES = {"table1": (0.0, 10.0, 20.0, 30.0, 40.0), "table2": (10.0, 20.0, 40.0, 60.0, 80.0)}
