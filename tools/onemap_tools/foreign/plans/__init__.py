"""The three apartments."""

from onemap_tools.foreign.apartment_plan import ApartmentPlan
from onemap_tools.foreign.plans.loft import LOFT_FLAT
from onemap_tools.foreign.plans.northern_flat import NORTHERN_FLAT
from onemap_tools.foreign.plans.old_town_flat import OLD_TOWN_FLAT

PLANS: tuple[ApartmentPlan, ...] = (NORTHERN_FLAT, OLD_TOWN_FLAT, LOFT_FLAT)
