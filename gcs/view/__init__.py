"""The web page: viser draws the world, the plan and the fleet; the operator's buttons become intents for the desk.

    server          life cycle: one port, one page, updated until cancelled
    page            one desk's page: what is drawn and told at which rate
    panels          buttons, vehicle selector, planning progress; the HTML of table, log and mission
    *_scene         viser nodes of the world, the plan, the vehicles, their trails and what lies ahead of them
    cameras         overview, top view, following a vehicle

Everything else is pure and knows no viser: colours, shapes, framing, labels, fleet_table, event_list, mission_card,
sightings, lines. The page's look is `page.css`.
"""
