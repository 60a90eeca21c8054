"""The ground station: cloud planner, MAVLink link, fleet state, flight sequence, reports, web page, CLI `gcs`.

Layers, each importing only what stands below it:

    cli             commands and their help
    app             composition root: builds the parts, runs them in one TaskGroup
    view            the viser page: reads the desk, hands in the operator's intents
    desk            what can be seen and done in a session
    flight          the flight sequence, its checks, monitor and reports
    station         all vehicles on all links: routes messages to services and state
    exchange        one microservice at work
    microservices   sans-IO MAVLink services (commands, missions, parameters)
    link, fleet     datagrams and recordings; telemetry folded into state
    replanning      when the cloud plans anew in flight, what for, and whether the answer is flown
    planner         E-CPSO, target allocation, the plan's judge
    mapping         what all vehicles have seen, in one map
    dialect         pymavlink as codec
"""
