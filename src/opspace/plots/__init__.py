"""Figures of recordings; the only place that uses matplotlib."""

from opspace.errors import missing_extra

try:
    import matplotlib as matplotlib
except ImportError:
    raise missing_extra("matplotlib", "sim") from None

from opspace.plots.forces import touch_figure as touch_figure
from opspace.plots.joint_limit import joint_limit_figures as joint_limit_figures
from opspace.plots.overview import overview_figure as overview_figure
from opspace.plots.plot_columns import overlay_columns as overlay_columns
from opspace.plots.plot_columns import plot_columns as plot_columns
from opspace.plots.singular_directions_plot import singularity_figures as singularity_figures
from opspace.plots.style import file_name as file_name
from opspace.plots.style import save as save
